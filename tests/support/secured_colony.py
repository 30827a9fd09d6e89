"""A colony of real processes in a deployment: every process has a certificate, and an operator's commands reach it."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from crcolony.protocol.roster import Role
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import Session, open_session
from tests.support.deployment import Deployment
from tests.support.lawless_session import open_lawless_session
from tests.support.process import Process, Robot
from tests.support.process_colony import Colony, View, colony


class SecuredColony:
    """An arena, robots and an observer with credentials, connected over mutual TLS."""

    def __init__(self, made: Colony, robots: int, hz: float, slots: int) -> None:
        self.made = made
        made.endpoint = made.endpoint.replace("tcp/", "tls/")
        self.deployment = Deployment(made.folder / "deployment")
        self.arena_credentials = self.deployment.member("arena", "main", arenas=("arena",))
        self.operator = self.deployment.member("operator", "me")
        watching = self.deployment.member("observer", "wall")
        admitted = [self.deployment.robot(f"robot{number}") for number in range(robots)]
        self.deployment.distribute_roster()
        self.arena = made.arena(
            slots, "--hz", f"{hz:g}", "--credentials", str(self.arena_credentials)
        )
        self.credentials: list[Path] = []
        self.departed: list[Path] = []
        """Stores of robots that were revoked and stopped"""
        for folder, credentials in admitted:
            self.start_robot(folder, credentials)
        self.view: View = made.observer("--credentials", str(watching))

    def start_robot(self, folder: Path, credentials: Path) -> Robot:
        """Start a robot that has been admitted; it speaks with its body over the network, as one of another host."""
        self.credentials.append(credentials)
        options = ("--credentials", str(credentials), "--no-shared-memory")
        return self.made.robot(*options, folder=folder)

    def insider(self, role: Role, name: str, arenas: tuple[str, ...] = ()) -> Path:
        """Admit another member while the colony runs, and let everybody know; return its credentials."""
        credentials = self.deployment.member(role, name, arenas=arenas)
        self.publish()
        return credentials

    def operate(self, *words: str) -> Process:
        """Run a command of `crcolony authority` with the operator's credentials, to its end."""
        action, *more = words
        folder = str(self.deployment.authority.folder)
        options = ("--credentials", str(self.operator), "--connect", self.made.endpoint)
        name = f"{action}-{len(self.made.processes)}"
        process = self.made.start(name, "authority", action, folder, *more, *options)
        process.wait(30.0)
        return process

    def publish(self) -> None:
        """Publish the present roster; everybody must have it."""
        published = self.operate("publish")
        assert published.wait(1.0) == 0, published.output

    def open_session(self, credentials: Path) -> Session:
        """Open a session with somebody's credentials, as every process does."""
        return open_session(self._network(credentials))

    def open_lawless_session(self, credentials: Path) -> Session:
        """Open a session of a member that obeys no access control itself."""
        return open_lawless_session(self.made.endpoint, credentials)

    def _network(self, credentials: Path) -> NetworkSettings:
        return NetworkSettings(connect=(self.made.endpoint,), credentials=credentials)


@contextlib.contextmanager
def secured_colony(
    folder: Path, robots: int = 3, hz: float = 20.0, spare_slots: int = 1
) -> Iterator[SecuredColony]:
    """A colony that is settled; its processes are killed at the end of the context."""
    with colony(folder) as made:
        secured = SecuredColony(made, robots, hz, robots + spare_slots)
        for robot in made.robots:
            robot.wait_for("has body")
        yield secured
