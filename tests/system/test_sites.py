"""Sites with routers of their own, joined over TLS: what each does alone, and what goes over the long link."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from crcolony.transport.zenoh_session import free_port
from tests.support.deployment import Deployment
from tests.support.mating_audit import check_ledger
from tests.support.process import Process, Robot, wait_until
from tests.support.process_colony import Colony, View, colony
from tests.support.wide_link import WideLink, wide_link

CLOCK = ("--hz", "20")
FAILOVER_S = 3.0


class Site:
    """A router, an arena and two robots, all with certificates of one authority.

    All are admitted before any of them runs: a router opens another session when somebody is, and without a second one
    its clients lose their bodies for a moment.
    """

    def __init__(self, made: Colony, deployment: Deployment, name: str, visitors: int = 0) -> None:
        self.made, self.name = made, name
        self.port = free_port()
        self.endpoint = f"tls/127.0.0.1:{self.port}"
        self.client = ("--client", "--connect", self.endpoint)
        self.admitted = [deployment.robot(f"{name}{number}") for number in range(2 + visitors)]
        self.of_router = deployment.member("router", name)
        self.of_arena = deployment.member("arena", name, arenas=(name,))
        self.of_observer = deployment.member("observer", name)

    def start(self, *seeds: str) -> None:
        """Start all but the visitors of other arenas."""
        connect = [word for seed in seeds for word in ("--connect", seed)]
        self.router = self.made.start(
            f"router-{self.name}", "router", "--listen", self.endpoint, *connect,
            "--credentials", str(self.of_router),
        )  # fmt: skip
        self.router.wait_for("router at")
        self.arena = self.made.arena(
            4, *CLOCK, *self.client, "--credentials", str(self.of_arena), name=self.name
        )
        self.robots = [self.start_robot(number, self.name) for number in range(2)]

    def start_robot(self, number: int, arena: str) -> Robot:
        """Start a robot of this site, with a body in an arena."""
        folder, credentials = self.admitted[number]
        options = ("--arena", arena, "--credentials", str(credentials), *self.client)
        return self.made.robot(*options, folder=folder)

    def watch(self) -> View:
        """Start an observer of this site."""
        return self.made.observer("--credentials", str(self.of_observer), *self.client[1:])


class Sites:
    """Two sites and the link between them; one robot of the west lives in the arena of the east."""

    def __init__(self, made: Colony, link: WideLink, east: Site, west: Site) -> None:
        self.made, self.link, self.east, self.west = made, link, east, west
        self.abroad = west.start_robot(2, "east")
        self.view = west.watch()


@pytest.fixture(scope="module")
def sites(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sites]:
    folder = tmp_path_factory.mktemp("sites")
    with colony(folder) as made:
        deployment = Deployment(folder / "deployment")
        east, west = Site(made, deployment, "east"), Site(made, deployment, "west", visitors=1)
        deployment.distribute_roster()
        east.start()
        with wide_link(east.port) as link:
            west.start(f"tls/127.0.0.1:{link.port}")
            both = Sites(made, link, east, west)
            for robot in made.robots:
                robot.wait_for("has body")
            yield both


def partners(robot: Robot) -> set[str]:
    """Return the first digits of the ids of those with whom a robot has mated."""
    return {
        line.split()[2].rstrip(",")
        for line in robot.output.splitlines()
        if line.startswith("mated with ")
    }


def ids(*robots: Robot) -> set[str]:
    return {robot.id.hex()[:8] for robot in robots}


def test_robots_mate_across_sites_where_it_is_configured_alone(sites: Sites) -> None:
    """The one that lives in the other site's arena mates there, over the long link; all others at home."""
    sites.abroad.wait_for("mated with", count=2)
    for robot in (*sites.east.robots, *sites.west.robots):
        robot.wait_for("mated with", count=2)
    east, west, abroad = ids(*sites.east.robots), ids(*sites.west.robots), ids(sites.abroad)
    assert partners(sites.abroad) <= east
    for robot in sites.east.robots:
        assert partners(robot) <= east | abroad
    for robot in sites.west.robots:
        assert partners(robot) <= west


def test_a_site_that_is_cut_off_mates_on(sites: Sites) -> None:
    """Undisturbed: no body is lost within a site; the robot abroad has its body back when the link is."""
    robots = (*sites.east.robots, *sites.west.robots)
    bodies = [robot.output.count("has body") for robot in robots]
    sites.link.cut()
    sites.abroad.wait_for("waiting for arena east")
    before = [robot.output.count("mated with") for robot in robots]
    wait_until(
        lambda: all(
            robot.output.count("mated with") >= count + 2
            for robot, count in zip(robots, before, strict=True)
        ),
        "all mate within their sites",
    )
    assert [robot.output.count("has body") for robot in robots] == bodies
    before_abroad = sites.abroad.output.count("mated with")
    sites.link.mend()
    sites.abroad.wait_for("mated with", count=before_abroad + 2)


def test_routers_join_again_after_one_has_panicked(sites: Sites) -> None:
    """A thread of Zenoh's may die (what it then writes is written here); the robot abroad has its body back."""
    with Path(f"/proc/{sites.west.router.pid}/fd/2").open("wb", buffering=0) as stderr:
        stderr.write(b"thread 'rx-1' (1) panicked at resource.rs:491:27:\n")
    sites.west.router.wait_for("a thread of Zenoh has panicked; opening another session")
    before = sites.abroad.output.count("mated with")
    sites.abroad.wait_for("mated with", count=before + 2)


def test_every_mating_has_both_sides_in_the_end(sites: Sites) -> None:
    """Also those over the link that was cut."""
    sites.made.finish(sites.view)
    check_ledger(sites.made.stores)


def killed_and_back(router: Process, robots: list[Robot], view: View) -> float:
    """Kill a router; return after how long (s) all robots have states on the network again."""
    router.kill()
    killed_unix_s = time.time()
    ids = [robot.id for robot in robots]
    return wait_until(
        lambda: len(view.fresh(ids, killed_unix_s + 0.2)) == len(ids) and view.are_connected(ids),
        "all robots are there through the other router",
        30.0,
    )


def test_clients_are_back_through_the_other_router(tmp_path: Path) -> None:
    """They hold both; one is killed, and within three seconds everybody is connected to everybody again."""
    with colony(tmp_path) as made:
        deployment = Deployment(tmp_path / "deployment")
        first, second = (f"tls/127.0.0.1:{free_port()}" for _ in range(2))
        clients = ("--client", "--connect", first, "--connect", second)
        routers = []
        for name, endpoint, connect in (
            ("first", first, ()),
            ("second", second, ("--connect", first)),
        ):
            own = str(deployment.member("router", name))
            options = ("--listen", endpoint, *connect, "--credentials", own)
            routers.append(made.start(name, "router", *options))
        arena = deployment.member("arena", "main", arenas=("arena",))
        admitted = [deployment.robot(f"robot{number}") for number in range(3)]
        watching = deployment.member("observer", "wall")
        deployment.distribute_roster()
        for router in routers:
            router.wait_for("router at")
        made.arena(3, *CLOCK, *clients, "--credentials", str(arena))
        for folder, credentials in admitted:
            made.robot(*clients, "--credentials", str(credentials), folder=folder)
        view = made.observer("--credentials", str(watching), "--connect", second)
        robots = made.robots
        ids = made.ids
        wait_until(lambda: view.are_connected(ids), "all are connected")
        assert killed_and_back(routers[0], robots, view) < FAILOVER_S
        view.wait_for_matings(4)
