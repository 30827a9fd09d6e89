"""Two robots in one process mate by the real protocol, and what of it outlives them is what a real file keeps."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from crcolony.config import load
from crcolony.experiments.colonies.mating_process import DiskInMemory, MatingProcess, robot_id_of
from crcolony.fault_simulation.simulated_network import Schedule
from crcolony.protocol.encounters import EncounterRecord, Offer
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Commit, Encounter, MatingMessage, Propose
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore

ONE, OTHER = robot_id_of(0), robot_id_of(1)
DELAY_S = 0.01


class Pair:
    """Two robots with full batteries, who conceive at every mating; `loses` says which messages get lost."""

    def __init__(self, loses: Callable[[float, MatingMessage], bool] = lambda _, __: False) -> None:
        config = load(None, ["robots=2", "life.agents=2", "life.initial_energy=1.0"])
        self.batch, _, self.robots = make_robots(config, ["0", "1"], numbered_streams(1, 0, 2))
        self.schedule = Schedule()
        self.sent: list[MatingMessage] = []
        self.decided: list[tuple[float, EncounterRecord]] = []
        self._loses = loses
        self.processes = [
            MatingProcess(robot, self.batch, self.schedule, self._send, self._on_decided)
            for robot in self.robots
        ]
        for robot, process in zip(self.robots, self.processes, strict=True):
            robot.start()
            process.start()

    def _send(self, to: RobotId, message: MatingMessage) -> None:
        self.sent.append(message)
        if not self._loses(self.schedule.now_s, message):
            receiver = self.processes[int(to == OTHER)]
            self.schedule.after(DELAY_S, partial(receiver.handle_message, message))

    def _on_decided(self, record: EncounterRecord, _: Decision) -> None:
        self.decided.append((self.schedule.now_s, record))

    def meet(self) -> None:
        for process, peer in zip(self.processes, (OTHER, ONE), strict=True):
            process.handle_contact(peer, nonce=7, tick=0)

    @property
    def pools(self) -> list[int]:
        return [len(robot.subpopulation.pool) for robot in self.robots]


def test_two_that_meet_both_decide_by_four_messages() -> None:
    """A moment later, the initiator a message earlier than the responder; nothing stays open."""
    pair = Pair()
    pair.meet()
    pair.schedule.run_until(5.0)
    assert [at_s for at_s, _ in pair.decided] == pytest.approx([2 * DELAY_S, 3 * DELAY_S])
    assert [record.role for _, record in pair.decided] == ["initiator", "responder"]
    assert len(pair.sent) == 4
    assert pair.pools == [1, 1]
    assert [process.open for process in pair.processes] == [0, 0]


def test_what_gets_lost_is_sent_again() -> None:
    """Everything of the first 0.3 s is lost, so that both mate later."""
    pair = Pair(lambda now_s, _: now_s < 0.3)
    pair.meet()
    pair.schedule.run_until(10.0)
    assert len(pair.decided) == 2
    assert min(at_s for at_s, _ in pair.decided) > 0.3
    assert pair.pools == [1, 1]


def test_an_encounter_of_which_no_message_arrives_comes_to_nothing() -> None:
    """For either robot."""
    pair = Pair(lambda _, __: True)
    pair.meet()
    pair.schedule.run_until(10.0)
    assert not pair.decided
    assert pair.pools == [0, 0]
    assert [process.outcomes["expired"] for process in pair.processes] == [1, 1]


def test_a_killed_robot_resumes_from_its_snapshot_with_the_conceptions_since() -> None:
    """What it has done since is lost."""
    pair = Pair()
    robot, process = pair.robots[0], pair.processes[0]
    pair.batch.energies[0] = 0.75
    process.save()
    pair.batch.energies[0] = 0.5
    pair.batch.energies[0, robot.agent] = 1.0
    pair.meet()
    pair.schedule.run_until(1.0)
    process.kill()
    assert not process.is_running
    robot.subpopulation.pool = []
    process.start()
    assert process.is_running
    assert pair.batch.energies[0].tolist() == [0.75, 0.75]
    assert pair.pools == [1, 1]


def test_one_that_is_killed_before_its_decision_has_arrived_sends_it_when_it_is_back() -> None:
    """Both mate, or neither: the decision was on its disk."""
    pair = Pair(lambda now_s, message: isinstance(message, Commit) and now_s < 1.0)
    pair.meet()
    pair.schedule.run_until(0.1)
    initiator, responder = pair.processes
    initiator.kill()
    responder.handle_peer_offline(ONE)
    pair.schedule.run_until(3.0)
    assert pair.pools == [1, 0]
    assert (initiator.open, responder.open) == (1, 1)
    initiator.start()
    initiator.handle_peer_online(OTHER)
    responder.handle_peer_online(ONE)
    pair.schedule.run_until(4.0)
    assert pair.pools == [1, 1]
    assert (initiator.open, responder.open) == (0, 0)
    assert responder.outcomes["mated"] == 1


def test_a_process_that_is_gone_handles_nothing() -> None:
    """Neither contacts nor messages nor its timers."""
    pair = Pair()
    pair.meet()
    for process in pair.processes:
        process.kill()
    pair.schedule.run_until(5.0)
    assert len(pair.sent) == 1
    assert isinstance(pair.sent[0], Propose)
    pair.meet()
    assert len(pair.sent) == 1


def test_the_disk_keeps_what_a_real_file_keeps(tmp_path: Path) -> None:
    """Open encounters, the last number of each initiator and whether it mated, and the decisions since a snapshot."""
    disk, schema = DiskInMemory(), bytes(16)
    store = RobotStore(tmp_path / "robot", OTHER, schema, durable=False)
    own, partner = Offer("1/0", b"genes"), Offer("0/0", b"others")
    decision = Decision(0.5, True, False, b"child", 3, bytes(16))

    def record(role: str, state: str, count: int) -> EncounterRecord:
        ends = (ONE, OTHER) if role == "responder" else (OTHER, ONE)
        encounter = Encounter(*ends, 1, count)
        return EncounterRecord(encounter, role, state, 7, 1, own, partner, b"proof")  # type: ignore[arg-type]

    for state, count in (("prepared", 1), ("mated", 1), ("prepared", 2), ("aborted", 2)):
        one = record("responder", state, count)
        disk.write([one])
        store.write([one], *((one, decision) if state == "mated" else ()))
    for role, state in (("initiator", "decided"), ("responder", "prepared")):
        one = record(role, state, 3)
        disk.write([one])
        store.write([one], *((one, decision) if state == "decided" else ()))
        assert list(disk.open.values()) == store.open_records()
        assert disk.marks == store.marks()
    store.close()
