"""A history is a chain of events: two are equal if their hashes are."""

import numpy as np
import pytest

from crcolony.evolution.history import (
    Born,
    Died,
    Event,
    HistoryHash,
    Lived,
    Mated,
    TurnedOver,
    birth_event,
)
from crcolony.evolution.lineage import Birth

EVENTS: list[Event] = [
    Born(0, 1, 0, "1/0", "digest", b"genes", None, None),
    Mated(5, 1, 2, "1/0", "2/0", 0.5, 0.7, True, False),
    Died(8, 1, "1/0"),
    Lived(9, 1, 0, "1/0", 8, 0.25, 3, 1),
    TurnedOver(9, 1, 1, 4),
]


def chain(events: list[Event]) -> str:
    """Return the hash of a history."""
    history = HistoryHash()
    for event in events:
        history.add(event)
    return str(history)


def test_the_hash_of_a_history_is_the_same_in_every_version() -> None:
    """The encoding of an event and the chain are part of what users compare between runs and
    machines."""
    assert str(HistoryHash()) == 32 * "0"
    assert chain(EVENTS) == "0f00594eae30f690705f72713e958719"


def test_equal_histories_have_equal_hashes_and_others_have_not() -> None:
    """Another order, a missing event or another number changes the hash."""
    assert chain(EVENTS) == chain(list(EVENTS))
    others = [EVENTS[::-1], EVENTS[:-1], [*EVENTS[:-1], TurnedOver(9, 1, 1, 5)]]
    assert len({chain(EVENTS), *map(chain, others)}) == 4


@pytest.mark.parametrize("length", range(len(EVENTS)))
def test_a_chain_is_resumed_from_its_state(length: int) -> None:
    """After a restart it has the same hash as without."""
    first = HistoryHash()
    for event in EVENTS[:length]:
        first.add(event)
    resumed = HistoryHash(first.state)
    for event in EVENTS[length:]:
        resumed.add(event)
    assert str(resumed) == chain(EVENTS)


def test_the_event_of_a_birth_has_the_genes_as_little_endian_numbers() -> None:
    """Whatever the memory layout of the array."""
    genes = np.arange(6.0).reshape(3, 2)[:, 0]
    birth = Birth("1/4", "1/0", "2/3", "digest", 2, 700)
    event = birth_event(11, 1, birth, genes)
    assert event == Born(
        11, 1, 2, "1/4", "digest", np.array([0.0, 2.0, 4.0], "<f8").tobytes(), "1/0", "2/3"
    )
