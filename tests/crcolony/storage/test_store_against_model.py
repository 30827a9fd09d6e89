"""Whatever a robot does with its file, the file agrees with a model that keeps everything in lists."""

import os
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from crcolony.evolution.history import Event
from crcolony.protocol.encounters import EncounterRecord
from crcolony.storage.rows import Decision
from tests.support.robot_stores import (
    OTHER,
    PEER,
    answered,
    decision,
    events,
    open_store,
    proposed,
    robot,
    see,
)


class AgainstAModel(RuleBasedStateMachine):
    """A file that is written, closed, killed and damaged, beside lists that are not."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name) / "robot.sqlite"
        self.store = open_store(self.path)
        self.records: dict[Any, EncounterRecord] = {}
        self.decisions: dict[Any, Decision] = {}
        self.snapshots: list[tuple[int, int, list[Event]]] = []
        """Number, decisions before it, events before it; the newest last"""
        self.number = 0

    @rule(is_ours=st.booleans(), peer=st.sampled_from([PEER, OTHER]))
    def meet(self, is_ours: bool, peer: bytes) -> None:
        self.number += 1
        if is_ours:
            record = proposed(self.number, peer=peer)
            self._write([record], record)
        else:
            self._write([answered(self.number, peer=peer)])

    @rule(state=st.sampled_from(["mated", "aborted"]), data=st.data())
    @precondition(lambda self: any(self._open()))
    def close_encounter(self, state: Any, data: st.DataObject) -> None:
        record = data.draw(st.sampled_from(self._open()))
        is_mated = record.state == "decided" or state == "mated"
        closed = replace(record, state="mated" if is_mated else "aborted")
        is_new = is_mated and closed.encounter not in self.decisions
        self._write([closed], closed if is_new else None)

    @rule(data=st.data())
    @precondition(lambda self: any(self._open()))
    def orphan(self, data: st.DataObject) -> None:
        self._write([replace(data.draw(st.sampled_from(self._open())), orphaned=True)])

    def _open(self) -> list[EncounterRecord]:
        return [r for r in self.records.values() if r.state in ("decided", "prepared")]

    def _write(
        self, records: list[EncounterRecord], decided: EncounterRecord | None = None
    ) -> None:
        made = decision(self.number) if decided else None
        self.store.write(records, decided, made)
        self.records |= {record.encounter: record for record in records}
        if decided and made:
            self.decisions[decided.encounter] = made

    @rule()
    def save(self) -> None:
        self.number += 1
        earlier = self.snapshots[-1][2] if self.snapshots else []
        self.store.save(robot(self.number), events(self.number), tick=self.number)
        saved = (self.number, len(self.decisions), earlier + events(self.number))
        self.snapshots = [*self.snapshots[-1:], saved]

    @rule()
    def restart(self) -> None:
        self.store.close()
        self.store = open_store(self.path)

    @rule()
    def kill(self) -> None:
        """Continue with copies of the files as they are."""
        copy = self.path.with_name(f"{self.number}-{os.urandom(4).hex()}.sqlite")
        for suffix in ("", "-wal"):
            source = self.path.with_name(self.path.name + suffix)
            copy.with_name(copy.name + suffix).write_bytes(source.read_bytes())
        self.store.close()
        self.path = copy
        self.store = open_store(copy)

    @rule()
    @precondition(lambda self: len(self.snapshots) == 2)
    def lose_newest_snapshot(self) -> None:
        newest = "(SELECT newest FROM head)"
        query = f"UPDATE snapshots SET robot = x'01' WHERE serial = {newest}"
        self.store._connection.execute(query)
        self.snapshots.pop()
        self.restart()

    @invariant()
    def file_and_model_are_equal(self) -> None:
        seen = see(self.store)
        number, decided, kept = self.snapshots[-1] if self.snapshots else (None, 0, [])
        assert seen.tick == number
        assert list(seen.events) == kept
        known = [(record, self.decisions.get(e)) for e, record in self.records.items()]
        assert list(seen.matings) == known
        late = list(self.decisions.items())[decided:]
        assert list(seen.since) == [(self.records[e], made) for e, made in late]
        assert list(seen.open) == self._open()

    def teardown(self) -> None:
        self.store.close()
        self.folder.cleanup()


TestAgainstAModel = AgainstAModel.TestCase
TestAgainstAModel.settings = settings(max_examples=30, stateful_step_count=25, deadline=None)
