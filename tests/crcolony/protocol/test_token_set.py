"""A robot is online from its first token to its last, whatever is repeated or forged."""

from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.token_set import MAX_TOKENS, TokenSet, TokenTable

tokens = st.tuples(st.integers(0, 2), st.sampled_from("ab"))


@given(st.lists(st.tuples(st.booleans(), tokens)))
def test_the_owner_changes_with_its_first_and_its_last_token(
    steps: list[tuple[bool, tuple[int, str]]],
) -> None:
    """True declares a token, False undeclares it; a token that is repeated or unknown changes nothing."""
    present, model = TokenSet(), set[tuple[int, str]]()
    for is_declared, token in steps:
        was_online = bool(model)
        if is_declared:
            model.add(token)
            assert present.add(token) == (not was_online)
        else:
            model.discard(token)
            assert present.remove(token) == (was_online and not model)
        assert set(present) == model
        assert len(present) == len(model)
        assert present.is_online == bool(model)


def test_tokens_keep_the_order_in_which_they_were_declared() -> None:
    """A token that is declared again stays where it is."""
    present = TokenSet()
    for token in ((3, "b"), (1, "a"), (3, "b")):
        present.add(token)
    assert list(present) == [(3, "b"), (1, "a")]


def test_tokens_beyond_the_limit_are_ignored() -> None:
    """Room that becomes free is used again."""
    present = TokenSet()
    for number in range(2 * MAX_TOKENS):
        assert present.add((number, "a")) == (number == 0)
    assert len(present) == MAX_TOKENS
    assert present.is_full
    assert not present.remove((MAX_TOKENS, "a"))
    present.remove((0, "a"))
    present.add((MAX_TOKENS, "a"))
    assert (MAX_TOKENS, "a") in present


def test_a_table_has_the_robots_that_are_online() -> None:
    """Each from its first token to its last, whatever the others do."""
    table = TokenTable()
    one, other = bytes(16), bytes([1]) * 16
    assert table.add(one, (1, "a"))
    assert not table.add(one, (2, "b"))
    assert table.add(other, (1, "a"))
    assert list(table) == [one, other]
    assert not table.remove(one, (1, "a"))
    assert not table.remove(one, (3, "c"))
    assert table.remove(one, (2, "b"))
    assert not table.remove(one, (2, "b"))
    assert one not in table
    assert len(table) == 1
