"""A session is replaced while it is used: what it declares is always declared somewhere."""

import contextlib
import time
from collections.abc import Callable, Iterator

import pytest
import zenoh

from crcolony.transport.close_session import close_session
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.session_renewal import SessionRenewal, hops
from crcolony.transport.zenoh_session import Session, free_port, has_links, is_taken, open_session
from tests.support.process import wait_until


class Answering:
    """Answers queries, in one session after the other."""

    def __init__(self, session: Session) -> None:
        self.sessions: list[Session] = []
        self.move_to(session)

    def move_to(self, session: Session) -> Callable[[], None]:
        self.sessions.append(session)

        def answer(query: zenoh.Query) -> None:
            with query:
                query.reply("question", b"answer")

        former = getattr(self, "_queryable", None)
        self._queryable = session.declare_queryable("question", answer)
        return lambda: former.undeclare() if former else None


@pytest.fixture
def asking() -> Iterator[tuple[Session, str]]:
    """A session that others can connect to, and its endpoint."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session = open_session(NetworkSettings(listen=(endpoint,)))
    yield session, endpoint
    close_session(session)


def replace(network: NetworkSettings, asking: Session) -> tuple[list[int], Answering]:
    """Replace a session; return how many answered each question meanwhile, and who answered."""
    session = open_session(network)
    user = Answering(session)
    wait_until(lambda: has_links(session), "a link")
    wait_until(lambda: list(asking.get("question", timeout=0.5)), "an answer")
    renewal = SessionRenewal(network, session, [user], lambda line: None)
    answers = []
    while not renewal.is_done:
        renewal.handle_timers(time.monotonic())
        replies = asking.get(
            "question",
            timeout=0.5,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )
        answers.append(sum(reply.ok is not None for reply in replies))
    close_session(renewal.session)
    return answers, user


@pytest.mark.parametrize("role", ["peer", "client"])
def test_somebody_answers_at_every_moment(asking: tuple[Session, str], role: str) -> None:
    """The former session, the next one, or both."""
    network = NetworkSettings(role=role, connect=(asking[1],))  # type: ignore[arg-type]
    answers, user = replace(network, asking[0])
    assert min(answers) >= 1
    assert len(user.sessions) == 2


def test_a_fixed_port_is_kept_by_a_session_in_between(asking: tuple[Session, str]) -> None:
    """Only one session can listen on it; in the end the last one does."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    network = NetworkSettings(listen=(endpoint,), connect=(asking[1],))
    between, last = hops(network)
    assert endpoint in between.connect
    assert last.listen == (endpoint,)
    assert set(between.listen) <= set(last.connect)
    answers, user = replace(network, asking[0])
    assert min(answers) >= 1
    assert len(user.sessions) == 3
    assert not is_taken(endpoint)  # it was closed


def test_a_renewal_that_is_cancelled_leaves_the_session_in_use(
    asking: tuple[Session, str],
) -> None:
    """Whatever it had opened is closed."""
    network = NetworkSettings(connect=(asking[1],))
    session = open_session(network)
    with contextlib.closing(session):
        wait_until(lambda: has_links(session), "a link")
        renewal = SessionRenewal(network, session, [], lambda line: None)
        renewal.cancel()
        assert renewal.session is session
        assert has_links(session)
    wait_until(lambda: not has_links(asking[0]), "all others are closed")
