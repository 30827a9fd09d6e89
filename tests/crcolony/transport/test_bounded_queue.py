"""A bounded queue keeps the order of its items, never exceeds its limits, and counts what it drops."""

import math
import threading

from hypothesis import given
from hypothesis import strategies as st

from crcolony.transport.bounded_queue import BoundedQueue


@given(st.lists(st.one_of(st.integers(0, 40), st.none())))
def test_items_that_fit_come_out_in_order_and_the_others_are_counted(
    steps: list[int | None],
) -> None:
    """A number is the size of an item that is put, `None` gets one; a plain list is the model."""
    queue, model, dropped = BoundedQueue[int](5, 100), list[tuple[int, int]](), 0
    for number, size in enumerate(steps):
        if size is None:
            assert queue.get() == (model.pop(0)[0] if model else None)
        else:
            fits = len(model) < 5 and sum(s for _, s in model) + size <= 100
            assert queue.put(number, size) == fits
            model += [(number, size)] if fits else []
            dropped += not fits
        assert len(queue) == len(model)
    assert queue.dropped == dropped
    assert queue.get_all() == [number for number, _ in model]
    assert queue.get() is None


def test_a_limit_factor_gives_an_item_more_room() -> None:
    """Twice as much with 2, and no limit at all with infinity."""
    queue = BoundedQueue[str](2, 10)
    assert [queue.put("a", 1) for _ in range(3)] == [True, True, False]
    assert [queue.put("b", 1, limit_factor=2.0) for _ in range(3)] == [True, True, False]
    assert queue.put("c", 1_000, limit_factor=math.inf)
    assert queue.get_all() == ["a", "a", "b", "b", "c"]
    assert queue.dropped == 2


def test_room_is_free_again_after_all_items_are_taken() -> None:
    """In items and in bytes."""
    queue = BoundedQueue[int](3, 30)
    for _ in range(2):
        assert [queue.put(k, 10) for k in range(4)] == [True, True, True, False]
        assert queue.get_all() == [0, 1, 2]
    assert queue.get_all() == []


def test_no_item_is_lost_between_threads() -> None:
    """Four threads put 5,000 items each while another takes them; each thread's items stay in order."""
    queue = BoundedQueue[tuple[int, int]](100_000, 1)
    received: list[tuple[int, int]] = []

    def put(name: int) -> None:
        for number in range(5_000):
            assert queue.put((name, number), 0)

    threads = [threading.Thread(target=put, args=(name,)) for name in range(4)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        received += queue.get_all()
    received += queue.get_all()
    for name in range(4):
        assert [number for one, number in received if one == name] == list(range(5_000))
