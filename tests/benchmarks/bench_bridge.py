"""What a bridge costs, and how fast it is: with the reference firmware on an emulated controller.

Run with `make bench`, or `python -m tests.benchmarks.bench_bridge`. Round trips are measured in turns: a PING of bare
bytes on the serial line, the same PING through the driver's session, and an action over Zenoh until the emulated motors
turn. Then the jitter of observations, an emergency stop, and CPU time and memory of the bridge's process.
"""

import contextlib
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import psutil
from crcolony_bridge.link import open_link
from crcolony_bridge.reference_firmware import messages
from crcolony_bridge.reference_firmware.driver import BAUD
from crcolony_bridge.reference_firmware.frames import FrameReader, encode_frame
from crcolony_bridge.reference_firmware.messages import MessageType
from crcolony_bridge.reference_firmware.session import FirmwareSession
from zenoh.handlers import Callback

from crcolony.body import contract
from crcolony.protocol.body_messages import (
    Action,
    BodyGranted,
    pack_row,
)
from crcolony.protocol.identity import seeded
from crcolony.protocol.key_expressions import ArenaKeys, parse_arena_token
from crcolony.runtime.emergency_stop import stop_robots
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import Session, open_session
from crcolony.transport.zenoh_tokens import tokens_online
from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.support.linked_robot import LinkedRobot
from tests.support.process_colony import Colony, Process, colony

TURNS = 200
HZ, MEASURED_S = 50.0, 10.0
STOPS = 10
BRIDGES = ((1, 50.0), (1, 10.0), (4, 10.0))
"""Robots and control periods a second of bridges whose costs are measured"""
MIB = 2**20


def main() -> None:
    """Measure all, and print the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with AvrRobot(folder, "alone") as robot:
            bare_ms, session_ms = measure_link(robot)
        print(f"PING on the bare serial line      {bare_ms:6.2f} ms")
        print(
            f"the same through the driver       {session_ms:6.2f} ms ({session_ms / bare_ms:.2f} times)"
        )
        with colony(folder) as made:
            measure_bridge(made, folder)
            for count, hz in BRIDGES:
                measure_costs(made, folder, count, hz)


def measure_link(robot: AvrRobot) -> tuple[float, float]:
    """Return the median round trip of a PING, bare and through the driver's session (ms)."""
    link = open_link(str(robot.host_link), BAUD)
    session = FirmwareSession(link, "robot")
    reader = FrameReader()
    bare, through = [], []

    def ping_bare(seq: int) -> None:
        link.write(encode_frame(messages.ping(0, seq)))
        while not any(frame.seq == seq for frame in reader.feed(link.read(1.0))):
            pass

    def ping_through() -> None:
        assert session.request(lambda seq: messages.ping(0, seq), MessageType.PONG) is not None

    for turn in range(TURNS):
        bare.append(timed_ms(lambda turn=turn: ping_bare(40_000 + turn)))  # type: ignore[misc]
        through.append(timed_ms(ping_through))
    link.close()
    return statistics.median(bare), statistics.median(through)


def timed_ms(work: Callable[[], None]) -> float:
    """Return how long a call takes (ms)."""
    began_s = time.perf_counter()
    work()
    return 1000.0 * (time.perf_counter() - began_s)


class RobotOfZenoh:
    """The least that can have a body: it joins, notes when observations arrive, and sends actions."""

    def __init__(self, session: Session, arena: str, number: int) -> None:
        keys, identity = ArenaKeys(arena), seeded("bench", 1, number)
        robot = identity.id
        tokens = map(parse_arena_token, tokens_online(session, keys.all_alive))
        self._end = LinkedRobot(identity, arena, next(t.arena_run for t in tokens if t), "bench")
        self.arrivals_s: list[float] = []
        self.tick = 0
        self._subscriber = session.declare_subscriber(
            keys.observation(robot), Callback(self._on_observation, indirect=False)
        )
        self._publisher = session.declare_publisher(keys.action(robot), express=True)
        for reply in session.get(keys.join(robot), payload=self._end.request()):
            assert reply.ok is not None
            assert isinstance(self._end.reply(reply.ok.payload.to_bytes()), BodyGranted)

    def _on_observation(self, sample: object) -> None:
        self.arrivals_s.append(time.perf_counter())
        opened = self._end.link.sense(sample.payload.to_bytes())  # type: ignore[attr-defined]
        self.tick = opened[0] if opened else self.tick

    def act(self, speed_m_s: float) -> None:
        """Answer the last observation."""
        row = np.zeros(contract.ACTION_WIDTH)
        row[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]] = speed_m_s
        row[contract.TTL] = 0.3
        self._publisher.put(self._end.seal(Action(self.tick, pack_row(row))))


def measure_bridge(made: Colony, folder: Path) -> None:
    """Print the round trip and jitter of a bridge with one robot at 50 Hz, and how soon a stop is confirmed."""
    with attached_robots(folder, 1) as robots, serving(made, robots, HZ):
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            body = RobotOfZenoh(session, "bridge", 0)
            delays = [
                reaction_ms(body, robots[0], 0.1 + 0.001 * turn) for turn in range(TURNS // 4)
            ]
            first = len(body.arrivals_s)
            drive_for(MEASURED_S, HZ, [body])
            periods_ms = 1000.0 * np.diff(body.arrivals_s[first:])
        stops_s = [stop_and_release(made) for _ in range(STOPS)]
    median, late = np.quantile(periods_ms, (0.5, 0.99))
    print(f"an action over Zenoh until wheels turn {statistics.median(delays):.1f} ms (median)")
    print(f"observations at {HZ:g} Hz: every {median:.2f} ms, 99 % within {late:.2f} ms")
    print(
        f"crcolony estop until the robot has confirmed {1000.0 * statistics.median(stops_s):.0f} ms"
        f" (median of {STOPS}, at most {1000.0 * max(stops_s):.0f} ms)"
    )


def measure_costs(made: Colony, folder: Path, count: int, hz: float) -> None:
    """Print CPU time and memory of a bridge whose robots are all driven."""
    with (
        attached_robots(folder, count) as robots,
        serving(made, robots, hz) as bridge,
        open_session(NetworkSettings(connect=(made.endpoint,))) as session,
    ):
        bodies = [RobotOfZenoh(session, "bridge", k) for k in range(count)]
        process = psutil.Process(bridge.pid)
        before, began_s = process.cpu_times(), time.perf_counter()
        drive_for(MEASURED_S, hz, bodies)
        took_s, after = time.perf_counter() - began_s, process.cpu_times()
        memory_mib = process.memory_info().rss / MIB
    cpu = (after.user + after.system - before.user - before.system) / took_s
    print(f"a bridge of {count} at {hz:g} Hz: {cpu:.1%} of a core, {memory_mib:.0f} MiB")


@contextlib.contextmanager
def attached_robots(folder: Path, count: int) -> Iterator[list[AvrRobot]]:
    """So many emulated robots, which are switched off at the end."""
    with contextlib.ExitStack() as opened:
        yield [opened.enter_context(AvrRobot(folder, f"bridged-{k}", k)) for k in range(count)]


@contextlib.contextmanager
def serving(made: Colony, robots: list[AvrRobot], hz: float) -> Iterator[Process]:
    """A bridge that serves them, and is stopped at the end."""
    named = [word for robot in robots for word in ("--robot", f"firmware@{robot.host_link}")]
    options = ("bridge", *named, "--hz", f"{hz:g}", "--listen", made.endpoint)
    bridge = made.start(f"bridge-{len(made.processes)}", *options)
    bridge.wait_for("bridge bridge with")
    yield bridge
    bridge.stop()


def drive_for(seconds: float, hz: float, bodies: list[RobotOfZenoh]) -> None:
    """Let all drive for so long, one action each in a control period."""
    end_s = time.perf_counter() + seconds
    while time.perf_counter() < end_s:
        for body in bodies:
            body.act(0.1)
        time.sleep(1.0 / hz)


def stop_and_release(made: Colony) -> float:
    """Return how long it took until all bodies have confirmed an emergency stop (s)."""
    network = NetworkSettings(connect=(made.endpoint,))
    result = stop_robots(network, "*", None)
    (reply,) = result.replies
    assert all(robot.confirmed for robot in reply.robots)
    stop_robots(network, "*", reply.latch)
    return result.took_s


def reaction_ms(body: RobotOfZenoh, robot: AvrRobot, speed_m_s: float) -> float:
    """Return how long an action takes until the motors' pins change (ms)."""
    seen, arrived = len(robot.lines), len(body.arrivals_s)
    while len(body.arrivals_s) == arrived:
        time.sleep(0.001)
    mm_s = round(1000 * speed_m_s)
    began_s = time.perf_counter()
    body.act(speed_m_s)
    robot.wait_for(f"wheels {mm_s} {mm_s}", since=seen)
    return 1000.0 * (time.perf_counter() - began_s)


if __name__ == "__main__":
    main()
