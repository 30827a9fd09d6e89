"""A PIN admits one member, once, for a while, and is void after few wrong attempts."""

from pathlib import Path

import pytest
from crcolony_deploy.invitations import (
    MAX_ATTEMPTS,
    InvitationBook,
    InvitationError,
    fingerprint_of,
    split_invitation,
)

NOW_S = 1_000_000.0


@pytest.fixture
def book(tmp_path: Path) -> InvitationBook:
    return InvitationBook(tmp_path)


def wrong(pin: str) -> str:
    return f"{(int(pin) + 1) % 10**8:08d}"


def test_an_invitation_is_used_once(book: InvitationBook) -> None:
    """By the member it was written for."""
    pin = book.invite("robot", "kitchen", NOW_S, 60.0)
    with pytest.raises(InvitationError, match="no open invitation"):
        book.use("robot", "hall", pin, NOW_S)
    with pytest.raises(InvitationError, match="no open invitation"):
        book.use("operator", "kitchen", pin, NOW_S)
    book.use("robot", "kitchen", pin, NOW_S)
    with pytest.raises(InvitationError, match="no open invitation"):
        book.use("robot", "kitchen", pin, NOW_S)


def test_an_invitation_expires(book: InvitationBook) -> None:
    """After the time it was given."""
    pin = book.invite("robot", "kitchen", NOW_S, 60.0)
    with pytest.raises(InvitationError, match="no open invitation"):
        book.use("robot", "kitchen", pin, NOW_S + 60.0)


def test_few_wrong_attempts_make_it_void(book: InvitationBook) -> None:
    """Of one member: another invitation is not touched."""
    pin, other = (book.invite("robot", name, NOW_S, 60.0) for name in ("kitchen", "hall"))
    for left in reversed(range(MAX_ATTEMPTS)):
        with pytest.raises(InvitationError, match=f"wrong PIN; {left} attempts"):
            book.use("robot", "kitchen", wrong(pin), NOW_S)
    with pytest.raises(InvitationError, match="no open invitation"):
        book.use("robot", "kitchen", pin, NOW_S)
    book.use("robot", "hall", other, NOW_S)


def test_a_second_invitation_replaces_the_first(book: InvitationBook) -> None:
    """The PIN that was lost is void."""
    first = book.invite("robot", "kitchen", NOW_S, 60.0)
    second = book.invite("robot", "kitchen", NOW_S, 60.0)
    if first != second:
        with pytest.raises(InvitationError, match="wrong PIN"):
            book.use("robot", "kitchen", first, NOW_S)
    book.use("robot", "kitchen", second, NOW_S)


def test_a_pin_is_nowhere_on_the_disk(book: InvitationBook, tmp_path: Path) -> None:
    """Only its hash, for its owner alone."""
    pin = book.invite("robot", "kitchen", NOW_S, 60.0)
    assert all(pin.encode() not in path.read_bytes() for path in tmp_path.iterdir())
    assert all(path.stat().st_mode & 0o077 == 0 for path in tmp_path.iterdir())


def test_what_is_typed_has_a_pin_and_a_fingerprint() -> None:
    """Anything else is refused before anybody is asked."""
    fingerprint = fingerprint_of(bytes(32))
    assert split_invitation(f" 01234567-{fingerprint.upper()}\n") == ("01234567", fingerprint)
    for text in (
        "",
        "1234567",
        f"1234567-{fingerprint}",
        "01234567-xyz",
        f"012345678{fingerprint}",
    ):
        with pytest.raises(InvitationError, match="an invitation is"):
            split_invitation(text)
