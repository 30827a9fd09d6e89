"""Hears everything that is said in a colony, from inside."""

from typing import Any

import zenoh

from crcolony.transport.zenoh_samples import callback, undeclare_all


class Spy:
    """Everything that is said in a colony, as a member receives it that everybody tells everything."""

    def __init__(self, session: zenoh.Session) -> None:
        self.heard: set[tuple[str, bytes]] = set()
        """Key, and payload; of tokens the payload is empty"""
        self._entities: list[Any] = [
            session.declare_subscriber("crcolony/**", callback(self._on_sample)),
            session.liveliness().declare_subscriber("crcolony/**", callback(self._on_sample)),
            session.declare_queryable("crcolony/**", callback(self._on_query)),
        ]

    def __enter__(self) -> "Spy":
        return self

    def __exit__(self, *_: object) -> None:
        undeclare_all(self._entities)

    def _on_sample(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.PUT:
            self.heard.add((str(sample.key_expr), sample.payload.to_bytes()))

    def _on_query(self, query: zenoh.Query) -> None:
        with query:
            payload = b"" if query.payload is None else query.payload.to_bytes()
            self.heard.add((str(query.key_expr), payload))
