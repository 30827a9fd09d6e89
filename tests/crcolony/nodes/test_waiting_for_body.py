"""Why a robot has no body is printed once, and is no fault."""

from crcolony.nodes.waiting_for_body import WaitingForBody


def test_an_arena_that_comes_soon_is_not_worth_a_line() -> None:
    """One that does not is, once."""
    waiting = WaitingForBody("lab")
    waiting.start(10.0)
    assert waiting.line_due(12.0) is None
    assert waiting.line_due(14.0) == "waiting for arena lab"
    assert waiting.line_due(100.0) is None


def test_every_new_reason_is_worth_a_line() -> None:
    """The arena is full, and then offline."""
    waiting = WaitingForBody("lab")
    waiting.start(0.0)
    waiting.handle_denial("full: all 4 slots are taken")
    assert waiting.line_due(4.0) == "no body from lab: full: all 4 slots are taken"
    assert waiting.handle_loss() == "the arena is offline; waiting for arena lab"
    assert waiting.line_due(5.0) is None
    assert waiting.reason == "waiting for arena lab"
