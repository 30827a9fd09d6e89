"""Says at which of the endpoints to connect to nobody answers, and why: Zenoh retries for ever without a word."""

import threading
import time
from collections.abc import Callable, Sequence
from types import TracebackType

from crcolony.transport.endpoint import DATAGRAMS, Endpoint, parse_endpoint
from crcolony.transport.reachability import reason_unreachable

_PERIOD_S = 2.0
"""Between two attempts at an endpoint at which nobody answers."""
_TIMEOUT_S = 2.0
_LINK_TIMEOUT_S = 10.0
"""Where somebody answers, a link of Zenoh's must follow within this time."""


def reasons_unreachable(endpoints: Sequence[str]) -> list[str]:
    """Try endpoints once; return a line for each at which nobody answers."""
    reasons = ((text, reason_unreachable(parse_endpoint(text), _TIMEOUT_S)) for text in endpoints)
    return [_format(text, reason) for text, reason in reasons if reason]


class ConnectionCheck:
    """Tries the endpoints on a thread of its own, until each has answered, and whenever all links are lost.

    `has_links` returns whether this process is connected to any other. `print_line` is called, on that thread, when
    something changes.
    """

    def __init__(
        self,
        endpoints: Sequence[str],
        has_links: Callable[[], bool],
        print_line: Callable[[str], None] = lambda line: None,
        period_s: float = _PERIOD_S,
        link_timeout_s: float = _LINK_TIMEOUT_S,
    ) -> None:
        self._endpoints = {text: parse_endpoint(text) for text in endpoints}
        self._has_links, self._print_line = has_links, print_line
        self._period_s, self._link_timeout_s = period_s, link_timeout_s
        self._reasons: dict[str, str] = {}
        """Of every endpoint that was tried why nobody answers; empty: somebody does"""
        self._answered_s: dict[str, float] = {}
        """Endpoints at which somebody answers although there is no link, and since when"""
        self._is_closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="connection check", daemon=True)

    def __enter__(self) -> "ConnectionCheck":
        if self._endpoints:
            self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._is_closed.set()

    @property
    def problems(self) -> list[str]:
        """What is wrong now, a line for every endpoint at which nobody answers."""
        return [_format(endpoint, why) for endpoint, why in self._reasons.copy().items() if why]

    def _run(self) -> None:
        while not self._is_closed.is_set():
            self._try_endpoints()
            self._is_closed.wait(self._period_s)

    def _try_endpoints(self) -> None:
        is_linked = self._has_links()
        if is_linked:
            self._answered_s.clear()
        for text, endpoint in self._endpoints.items():
            if is_linked and self._reasons.get(text) == "":
                continue
            reason = reason_unreachable(endpoint, _TIMEOUT_S)
            if reason:
                self._answered_s.pop(text, None)
            elif not is_linked:
                reason = self._reason_unlinked(text, endpoint)
            if self._is_closed.is_set():
                return
            self._set_reason(text, reason)

    def _reason_unlinked(self, text: str, endpoint: Endpoint) -> str:
        """Return what is wrong where no link follows; empty while it may still follow."""
        now_s = time.monotonic()
        if now_s - self._answered_s.setdefault(text, now_s) < self._link_timeout_s:
            return ""
        return "no reply" if endpoint.protocol in DATAGRAMS else "another program is there"

    def _set_reason(self, text: str, reason: str) -> None:
        before = self._reasons.get(text, "")
        self._reasons[text] = reason
        if reason and reason != before:
            self._print_line(f"{_format(text, reason)}; retrying")
        elif before and not reason:
            self._print_line(f"{text} answers")


def _format(endpoint: str, reason: str) -> str:
    return f"no robot, arena or router answers at {endpoint} ({reason})"
