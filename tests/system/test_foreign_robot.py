"""A robot without a line of ours lives among our robots, mates, survives, and is refused when it cheats."""

import re
from collections.abc import Callable, Iterable
from pathlib import Path

from crcolony.evolution.history import Born, Event
from crcolony.protocol.codec import encode
from crcolony.protocol.telemetry_messages import (
    HistoryRequest,
    RobotEvent,
    decode_event,
    decode_history_reply,
    decode_robot_metadata,
)
from crcolony.storage.reading import read_stored_robot
from tests.support.foreign_colony import (
    ForeignColony,
    foreign_colony,
    key_between,
    open_encounters,
    read_ledger,
)
from tests.support.observer import EventReceived
from tests.support.process import Robot, wait_until

FEW = 3
"""Matings, or refusals, that are no accident."""


def test_it_lives_mates_in_both_roles_and_survives_being_killed(tmp_path: Path) -> None:
    """Both disks agree about every mating; agents of each kind descend from the other's; nothing is left open."""
    with foreign_colony(tmp_path, slots=3) as setup:
        made, view = setup.made, setup.view
        stores = made.stores
        key = key_between(made.ids[0], made.ids[1])
        foreign = setup.start("foreign", "--lifetime-steps", "100", key=key)
        me = foreign.id
        wait_until(lambda: _mates_with_both(setup, foreign), "it mates in both roles")
        _answers_observers(setup, foreign)
        for message in ("commit", "accept"):
            _die_before(setup, foreign, message)
        before = len(setup.matings_of(foreign))
        wait_until(lambda: len(setup.matings_of(foreign)) >= before + FEW, "it mates on")
        wait_until(lambda: _have_father(_published(setup, me), made.ids), "an agent of our father")
        wait_until(lambda: _have_father(_stored(stores), [me]), "an agent of its father")
        made.finish(view)
        foreign.stop()
        assert not open_encounters(foreign)
        ledger = read_ledger(stores, [foreign])
        for partner in made.ids:
            mixed = [sides for sides in ledger.values() if set(sides) == {me, partner}]
            assert len(mixed) >= FEW
            assert any(sides[partner].conceived for sides in mixed)
            assert any(sides[me].conceived for sides in mixed)
        assert {encounter for _, encounter in view.mated_encounters()} <= set(ledger)


def test_one_that_cheats_is_refused_and_the_others_mate_on(tmp_path: Path) -> None:
    """Genes, signatures, codes, names, requests of yesterday, and a decision that nobody was prepared for."""
    with foreign_colony(tmp_path, slots=3) as setup:
        arena, ours = setup.made.arenas[0], setup.made.robots[1]
        said = ("the envelope's key is not the robot's", "under the key of another robot")

        def come_back(it: Robot) -> bool:
            ours.stop()
            ours.start()
            ours.wait_for("mated with", FEW)
            it.wait_for("repeats join join leave", FEW)  # its own, and two of ours
            assert ours.output.count("has body") == 1, ours.output
            return True

        refused = [
            _cheat(setup, "genes", lambda _: setup.refused(FEW)),
            _cheat(setup, "signature", lambda _: setup.refused(FEW)),
            _cheat(setup, "commit", lambda it: it.output.count("expired") >= FEW),
            _cheat(setup, "code", lambda it: setup.observed(it.id, 2 * FEW)),
        ]
        harmless = [
            _cheat(setup, "name", lambda _: all(line in arena.output for line in said)),
            _cheat(setup, "replay", come_back),
        ]
        setup.made.finish(setup.view)
        counted = re.findall(r"\d+ (\w+)", arena.output.rpartition("refused: ")[2])
        assert {"forged", "malformed", "stale"} <= set(counted), arena.output
        ledger = read_ledger(setup.made.stores, [*refused, *harmless])
        for sides in ledger.values():
            assert not set(sides) & {it.id for it in refused}, "one that cheats has mated"
        honest = [sides for sides in ledger.values() if set(sides) == set(setup.made.ids)]
        assert len(honest) >= FEW * len(refused)


def _cheat(setup: ForeignColony, kind: str, has_failed: Callable[[Robot], bool]) -> Robot:
    """One robot cheats until that has failed; ours mate meanwhile, and after it has left."""
    setup.forget_refusals()
    key = key_between(setup.made.ids[0], setup.made.ids[1])  # it cheats in both roles
    cheating = setup.start(kind, "--cheat", kind, script="cheats", key=key)
    cheating.wait_for("has body")
    wait_until(lambda: has_failed(cheating), f"it is refused: {kind}")
    assert cheating.is_running, cheating.output
    assert "deceived" not in cheating.output
    cheating.stop()
    setup.view.wait_for_matings(FEW, of=setup.made.ids[0])
    return cheating


def _mates_with_both(setup: ForeignColony, foreign: Robot) -> bool:
    """Ids decide who proposes: the foreign robot to one of ours, the other one to it."""
    initiators = [encounter.initiator for encounter in setup.matings_of(foreign)]
    return all(initiators.count(robot) >= FEW for robot in (foreign.id, min(setup.made.ids)))


def _answers_observers(setup: ForeignColony, foreign: Robot) -> None:
    """It has the schema of the others, and keeps its events."""
    metadata = [decode_robot_metadata(reply) for reply in setup.ask("metadata", "*", 3)]
    assert {one.robot for one in metadata} == {foreign.id, *setup.made.ids}
    assert len({one.schema for one in metadata}) == 1
    incarnation = next(one.incarnation for one in metadata if one.robot == foreign.id)
    request = encode(HistoryRequest(incarnation, 2))
    (reply,) = setup.ask("history", foreign.id.hex(), 1, request)
    history = decode_history_reply(reply)
    assert [decode_event(event).seq for event in history.events][:3] == [2, 3, 4]


def _die_before(setup: ForeignColony, foreign: Robot, message: str) -> None:
    """It is killed after a write and before what it says of it; started again, it ends that encounter."""
    foreign.stop()
    assert setup.start(foreign.folder.name, "--before", message, script="dying").wait() == -9
    left_open = open_encounters(foreign)
    assert left_open
    foreign.start()
    wait_until(lambda: not left_open & open_encounters(foreign), "what was open has ended")


def _have_father(events: Iterable[RobotEvent | Event], robots: list[bytes]) -> bool:
    fathers = [event.father for event in events if isinstance(event, Born) and event.father]
    return any(father.startswith(f"{robot.hex()}/") for father in fathers for robot in robots)


def _published(setup: ForeignColony, robot: bytes) -> list[RobotEvent]:
    messages = [line.message for line in setup.view.all(EventReceived)]
    return [message.event for message in messages if message.robot == robot]


def _stored(stores: list[Path]) -> list[Event]:
    return [event for path in stores for event in read_stored_robot(path).events]
