"""Robots of a colony live in robots with real firmware: unchanged processes, emulated controllers, real faults."""

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.robot_firmware_bridge.firmware import WORDS_ALONE, needs_avr
from tests.robot_firmware_bridge.ir_air import IrAir
from tests.support.mating_audit import check_ledger
from tests.support.paths import PYTHONPATH
from tests.support.process import Process, Robot, wait_until
from tests.support.process_colony import Colony, colony, crcolony

pytestmark = needs_avr

FIRMWARE_STOPS_S = 0.5
"""The longest time to live of a command in the firmware"""
MARGIN_S = 0.5
"""For a busy machine"""


@dataclass
class Lab:
    """Two emulated robots that face each other, a bridge, and a colony of two robots that live in them."""

    made: Colony
    emulated: list[AvrRobot]
    ports: list[Path]
    """The devices of the robots, as the bridge knows them"""
    air: IrAir
    bridge: Process
    robots: list[Robot]

    def moves(self, k: int, within_s: float = 30.0) -> None:
        """Wait until the wheels of an emulated robot are turned anew."""
        since = len(self.emulated[k].lines)
        self.emulated[k].wait_for(r"wheels .*[1-9]", within_s, since)

    def stops(self, k: int, within_s: float) -> None:
        """Check that the wheels stand still after this time, and stay so for a while."""
        robot = self.emulated[k]
        time.sleep(within_s)  # that nothing happens after it is all there is to see
        since = len(robot.lines)
        assert robot.wheels == (0, 0)
        time.sleep(0.5)
        assert not [line for line in robot.lines[since:] if line.startswith("wheels")]


@contextlib.contextmanager
def open_lab(folder: Path, defines: str = "", *settings: str) -> Iterator[Lab]:
    """Open a lab in which both robots have their bodies and drive.

    `defines` is what differs from the default firmware, `settings` from a busy colony.
    """
    with contextlib.ExitStack() as opened:
        emulated = [
            opened.enter_context(AvrRobot(folder, name, uid, defines))
            for uid, name in enumerate(("left", "right"))
        ]
        ports = [folder / f"ttyACM{k}" for k in range(2)]
        for port, robot in zip(ports, emulated, strict=True):
            port.symlink_to(robot.host_link)
        air = IrAir([robot.ir_link for robot in emulated])
        opened.callback(air.close)
        made = opened.enter_context(colony(folder, *settings))
        named = [option for port in ports for option in ("--robot", f"firmware@{port}")]
        bridge = made.start("bridge", "bridge", *named, "--arena", "lab", "--listen", made.endpoint)
        bridge.wait_for("bridge lab with 2 robots")
        robots = []
        for slot in range(2):
            robots.append(made.robot("--arena", "lab", "--snapshot", "2"))
            robots[-1].wait_for(f"has body {slot}")
        yield Lab(made, emulated, ports, air, bridge, robots)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A lab with the firmware as it is by default."""
    with open_lab(tmp_path_factory.mktemp("lab")) as opened:
        yield opened


def test_robots_drive_physical_bodies(lab: Lab) -> None:
    """Wheels of both turn as they decide, and stand still when they leave."""
    for k in range(2):
        lab.moves(k)


def test_two_robots_that_hear_each_other_mate(lab: Lab) -> None:
    """Both have the contact by infrared, and the ledger of their matings is exact."""
    for robot in lab.robots:
        robot.wait_for("mated with", 2)
    lab.air.is_clear = False
    counts = [robot.output.count("mated with") for robot in lab.robots]
    carried = lab.air.carried_bytes
    wait_until(lambda: lab.air.carried_bytes > carried + 2000, "beacons are on")
    later = [robot.output.count("mated with") for robot in lab.robots]
    assert max(after - before for after, before in zip(later, counts, strict=True)) <= 1
    lab.air.is_clear = True


def test_wheels_stop_when_a_robot_is_killed_and_turn_again_when_it_is_back(lab: Lab) -> None:
    """By the time to live of its last action: nobody has to notice."""
    lab.moves(0)
    lab.robots[0].kill()
    lab.stops(0, FIRMWARE_STOPS_S + MARGIN_S)
    lab.moves(1)
    lab.robots[0].start()
    lab.moves(0)


def test_wheels_stop_when_the_bridge_is_frozen_or_killed(lab: Lab) -> None:
    """The firmware stops them; a new bridge serves the same robots, and they live on."""
    lab.moves(0)
    lab.bridge.signal(signal.SIGSTOP)
    lab.stops(0, FIRMWARE_STOPS_S + MARGIN_S)
    lab.bridge.signal(signal.SIGCONT)
    lab.moves(0)
    lab.bridge.kill()
    lab.stops(0, FIRMWARE_STOPS_S + MARGIN_S)
    lab.bridge.start()
    for k in range(2):
        lab.moves(k)


def test_a_robot_that_is_unplugged_rests_and_comes_back(lab: Lab) -> None:
    """Its robot waits without a body that moves; the other one lives on."""
    lab.emulated[0].switch_off()
    lab.bridge.wait_for("ttyACM0: lost")
    lab.moves(1)
    lab.emulated[0].start()
    lab.moves(0)


def test_a_robot_with_a_critical_battery_rests_until_it_is_charged(lab: Lab) -> None:
    """It stands still, its robot lives on when it is charged, and the other one does not notice."""
    lab.moves(0)
    lab.emulated[0].set_battery(6.1)
    lab.bridge.wait_for("ttyACM0: battery critical: it stands still until it is charged")
    lab.stops(0, FIRMWARE_STOPS_S + MARGIN_S)
    lab.moves(1)
    lab.emulated[0].set_battery(7.8)
    lab.bridge.wait_for("ttyACM0: battery charged")
    lab.moves(0)


def test_an_emergency_stop_reaches_all_and_only_its_latch_releases_them(lab: Lab) -> None:
    """`crcolony estop` says how many have confirmed, and how to go on."""
    for k in range(2):
        lab.moves(k)
    stopped = run("estop", "--connect", lab.made.endpoint)
    assert "2 of 2 bodies stopped" in stopped.stdout
    assert stopped.returncode == 0
    for k in range(2):
        lab.stops(k, MARGIN_S)
    again = run("estop", "--connect", lab.made.endpoint)
    assert "2 of 2 bodies stopped" in again.stdout, "who stops twice is not told that it failed"
    assert again.stdout.split()[-1] == stopped.stdout.split()[-1]
    assert run("estop", "--clear", "5", "--connect", lab.made.endpoint).returncode == 5
    latch = stopped.stdout.split()[-1]
    assert run("estop", "--clear", latch, "--connect", lab.made.endpoint).returncode == 0
    for k in range(2):
        lab.moves(k)


def test_an_emergency_stop_names_who_has_not_confirmed(lab: Lab) -> None:
    """A robot that is unplugged, and a bridge that is frozen: neither is taken for stopped."""
    lab.emulated[1].switch_off()
    lab.bridge.wait_for(f"{lab.ports[1]}: lost", count=lab.bridge.output.count("ttyACM1: lost") + 1)
    stopped = run("estop", "--connect", lab.made.endpoint)
    assert "1 of 2 bodies stopped" in stopped.stdout
    assert f"NOT stopped: firmware@{lab.ports[1]} of lab: lost" in stopped.stdout
    assert stopped.returncode == 5
    lab.stops(0, MARGIN_S)
    lab.emulated[1].start()
    lab.bridge.wait_for(f"{lab.ports[1]}: connected", count=2)
    lab.stops(1, MARGIN_S)
    again = run("estop", "--connect", lab.made.endpoint)
    assert "2 of 2 bodies stopped" in again.stdout
    lab.bridge.signal(signal.SIGSTOP)
    unknown = run("estop", "--connect", lab.made.endpoint)
    lab.bridge.signal(signal.SIGCONT)
    assert unknown.stdout.startswith("nobody can be reached: what moves, moves on")
    assert unknown.returncode == 5
    latch = again.stdout.split()[-1]
    assert run("estop", "--clear", latch, "--connect", lab.made.endpoint).returncode == 0
    for k in range(2):
        lab.moves(k)


def test_a_robot_whose_cable_is_put_into_another_port_is_found_there(lab: Lab) -> None:
    """By its uid: ttyACM0 becomes ttyACM1."""
    port = lab.ports[1]
    lab.emulated[1].switch_off()
    lab.bridge.wait_for(f"{port}: lost", count=1)
    lab.emulated[1].start()
    port.rename(port.with_name("ttyACM5"))
    lab.moves(1)
    port.with_name("ttyACM5").rename(port)


def test_nothing_was_lost(lab: Lab) -> None:
    """After all of this both leave, their wheels stand still, and their ledgers agree."""
    for robot in lab.robots:
        robot.stop()
    for k in range(2):
        lab.stops(k, FIRMWARE_STOPS_S + MARGIN_S)
    lab.bridge.stop()
    for board in lab.emulated:
        board.switch_off()
    check_ledger(lab.made.stores)


@pytest.mark.alone
def test_two_robots_on_separate_networks_mate_by_infrared_alone(tmp_path: Path) -> None:
    """Genotypes and all, through the whole protocol: their bridges stand in for the other one."""
    with contextlib.ExitStack() as opened:
        emulated = [opened.enter_context(AvrRobot(tmp_path, name)) for name in ("left", "right")]
        air = IrAir([robot.ir_link for robot in emulated])
        opened.callback(air.close)
        sites = []
        for k, robot in enumerate(emulated):
            (folder := tmp_path / f"site-{k}").mkdir()
            made = opened.enter_context(colony(folder))
            options = ("--robot", f"firmware@{robot.host_link}", "--listen", made.endpoint)
            made.start("bridge", "bridge", *options, "--arena", "lab").wait_for("bridge lab with")
            made.robot("--arena", "lab")
            sites.append(made)
        inhabitants = [made.robots[0] for made in sites]
        for inhabitant in inhabitants:
            inhabitant.wait_for("mated with", within_s=120.0)
        air.is_clear = False
        for made in sites:
            view = made.observer()
            wait_until(lambda view=view, made=made: view.alive() == set(made.ids), "they are alone")  # type: ignore[misc]
        for inhabitant in inhabitants:
            inhabitant.stop()
        stores = [store for made in sites for store in made.stores]
        assert check_ledger(stores, is_settled=False).matings >= 1


@pytest.mark.alone
def test_two_robots_whose_infrared_carries_words_alone_mate_over_the_network(
    tmp_path: Path,
) -> None:
    """Eleven bits at a time prove that they are near; the whole protocol goes over Zenoh."""
    with open_lab(tmp_path, WORDS_ALONE, "life.slice_steps=50") as lab:
        for robot in lab.robots:
            robot.wait_for("mated with", within_s=120.0)
        for robot in lab.robots:
            robot.stop()
        assert check_ledger(lab.made.stores, is_settled=False).matings >= 1


def test_two_robots_with_one_uid_are_refused(tmp_path: Path) -> None:
    """Their calibrations, and who is who after a cable was pulled, would be mixed up."""
    with AvrRobot(tmp_path, "one", 7) as one, AvrRobot(tmp_path, "two", 7) as two:
        links = (one.host_link, two.host_link)
        named = [word for link in links for word in ("--robot", f"firmware@{link}")]
        refused = run("bridge", *named, "--listen", "tcp/127.0.0.1:0")
    assert refused.returncode == 2
    assert "both have the uid 0702030405060708" in refused.stderr
    assert refused.stderr.count("\n") == 1


def test_an_emergency_stop_names_an_arena_that_hangs(tmp_path: Path) -> None:
    """It cannot be connected to any more; who was connected before knows of it. Two may have the same name."""
    with colony(tmp_path) as made:
        made.arena(1).wait_for("arena arena with")
        options = ("arena", "--robots", "1", "--connect", made.endpoint, "--out")
        twin = made.start("twin", *options, str(tmp_path / "twin"))
        twin.wait_for("arena arena with")
        both = run("estop", "--connect", made.endpoint)
        assert both.stdout.count("to release: ") == 2
        twin.signal(signal.SIGSTOP)
        stopped = run("estop", "--connect", made.endpoint)
        twin.signal(signal.SIGCONT)
        assert "NO ANSWER from arena (session " in stopped.stdout
        assert stopped.returncode == 5


def test_simulated_bodies_stop_as_well(tmp_path: Path) -> None:
    """All of an arena as one, and they live on when they are released."""
    with colony(tmp_path) as made:
        made.arena(2, "--hz", "20")
        for _ in range(2):
            made.robot()
        view = made.observer()
        wait_until(lambda: view.are_connected(made.ids), "two robots with bodies")
        stopped = run("estop", "--connect", made.endpoint)
        assert "2 of 2 bodies stopped" in stopped.stdout, stopped
        assert stopped.returncode == 0
        latch = stopped.stdout.split()[-1]
        released = run("estop", "--clear", latch, "--connect", made.endpoint)
        assert "2 of 2 bodies released" in released.stdout
        view.wait_for_matings(1)


def run(*options: str) -> "subprocess.CompletedProcess[str]":
    """Run a command to its end."""

    return subprocess.run(
        crcolony(*options),
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": PYTHONPATH},
        timeout=30,
    )
