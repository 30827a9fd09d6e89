"""Fragments become the message that was sent, or nothing."""

from collections.abc import Iterator

from crcolony_bridge.infrared.ir_messages import Fragment, IrReceiver, seal, tag_of
from hypothesis import given
from hypothesis import strategies as st

MESSAGES = st.binary(min_size=1, max_size=600)


def fragments(message: bytes) -> Iterator[Fragment]:
    """Return what a beacon sends of a message, in order."""
    sealed = seal(message)
    parts = [sealed[k : k + 48] for k in range(0, len(sealed), 48)]
    return (Fragment(tag_of(sealed), k, len(parts), part) for k, part in enumerate(parts))


@given(
    st.lists(MESSAGES, min_size=1, max_size=4, unique_by=lambda m: (seal(m)[0], len(m))),
    st.randoms(),
)
def test_messages_of_several_senders_arrive_in_any_order(
    messages: list[bytes], random: object
) -> None:
    """Each exactly once, although a beacon repeats it."""
    receiver = IrReceiver()
    sent = [fragment for message in messages for fragment in fragments(message)]
    sent += sent
    random.shuffle(sent)  # type: ignore[attr-defined]
    received = [message for message in map(receiver.add, sent) if message is not None]
    assert sorted(received) == sorted(messages)


@given(MESSAGES, st.data())
def test_a_damaged_message_is_dropped(message: bytes, data: st.DataObject) -> None:
    """The digest finds what a fragment's CRC lets pass."""
    sent = list(fragments(message))
    k = data.draw(st.integers(0, len(sent) - 1))
    byte = data.draw(st.integers(0, len(sent[k].data) - 1))
    damaged = bytearray(sent[k].data)
    damaged[byte] ^= data.draw(st.integers(1, 255))
    sent[k] = Fragment(sent[k].tag, k, sent[k].count, bytes(damaged))
    receiver = IrReceiver()
    assert all(receiver.add(fragment) is None for fragment in sent)
    assert receiver.damaged == 1


def test_endless_first_fragments_take_no_memory() -> None:
    """Of a sender that never finishes."""
    receiver = IrReceiver()
    for k in range(100_000):
        assert receiver.add(Fragment(k % 256, 0, 2 + k % 60, bytes(48))) is None
    assert len(receiver._open) <= 9
