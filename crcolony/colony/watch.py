"""What a watcher knows of colonies, from their telemetry alone: who is alive, how they are, and what it has missed."""

from dataclasses import dataclass, field

from crcolony.colony import keys, telemetry
from crcolony.colony.identity import RobotId
from crcolony.colony.messages import WireError
from crcolony.colony.telemetry import Scene, State, Told


@dataclass
class Watched:
    """One robot, as it was last heard of."""

    robot: RobotId
    colony: str
    lives: dict[tuple[int, str], None] = field(default_factory=dict)
    """Life and session of its tokens on the network"""
    state: State | None = None
    heard_s: float = 0.0
    seq: int = 0
    """The last event of its present life that arrived"""
    missed: int = 0
    restarts: int = 0

    @property
    def is_alive(self) -> bool:
        """Whether it is on the network."""
        return bool(self.lives)


class Watch:
    """Takes what is published, keeps the latest, and never fails: what is malformed is counted."""

    def __init__(self) -> None:
        self.robots: dict[RobotId, Watched] = {}
        self.scenes: dict[str, Scene] = {}
        self.arenas: dict[str, set[str]] = {}
        """The sessions of every arena that is alive"""
        self.malformed = 0

    def token(self, key: str, is_there: bool) -> None:
        """Take a liveliness token of a robot or an arena."""
        robot, arena = keys.robot_token(key), keys.arena_token(key)
        if robot is not None:
            watched = self.robots.setdefault(robot.robot, Watched(robot.robot, robot.colony))
            if is_there:
                watched.lives[robot.life, robot.session] = None
            else:
                watched.lives.pop((robot.life, robot.session), None)
        elif arena is not None:
            sessions = self.arenas.setdefault(arena.arena, set())
            (sessions.add if is_there else sessions.discard)(arena.session)
        else:
            self.malformed += 1

    def told_state(self, key: str, data: bytes, now_s: float) -> None:
        """Take a robot's state."""
        try:
            state = telemetry.decode_state(data)
        except WireError:
            self.malformed += 1
            return
        watched = self.robots.setdefault(state.robot, Watched(state.robot, keys.chunks(key)[1]))
        if watched.state is not None and state.life > watched.state.life:
            watched.restarts += 1
            watched.seq = 0
        watched.state, watched.heard_s = state, now_s

    def told_event(self, data: bytes) -> Told | None:
        """Take an event; return it if it is new, and count what was missed before it."""
        try:
            told = telemetry.decode_told(data)
        except WireError:
            self.malformed += 1
            return None
        watched = self.robots.get(told.robot)
        if watched is not None:
            if watched.seq and told.seq > watched.seq + 1:
                watched.missed += told.seq - watched.seq - 1
            watched.seq = max(watched.seq, told.seq)
        return told

    def told_scene(self, data: bytes) -> None:
        """Take an arena's scene."""
        try:
            scene = telemetry.decode_scene(data)
        except WireError:
            self.malformed += 1
            return
        self.scenes[scene.arena] = scene

    @property
    def alive(self) -> list[Watched]:
        """Robots on the network, in order of their number and id."""
        return [watched for watched in self.all if watched.is_alive]

    @property
    def all(self) -> list[Watched]:
        """All robots ever heard of, in order of their number and id."""
        return sorted(
            self.robots.values(), key=lambda w: (w.state.number if w.state else 2**31, w.robot)
        )
