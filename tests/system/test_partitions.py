"""Every process on a host of its own: cables are cut, packets lost, the network splits; both mate or neither."""

import time
from collections.abc import Iterator

import pytest

from tests.support.colony_in_namespaces import FAULTS, Cabled, Fault, cabled, detection_s, outcomes
from tests.support.mating_audit import check_ledger
from tests.support.namespaces import needs_namespaces
from tests.support.process import wait_until

pytestmark = needs_namespaces


@pytest.fixture(scope="module")
def lan(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cabled]:
    """Four robots and an arena on five hosts, for all tests here; afterwards their ledger is exact."""
    with cabled(tmp_path_factory.mktemp("lan")) as made:
        made.settle()
        yield made
        made.settle()
        made.colony.finish(made.view)
        ledger = check_ledger(made.colony.stores)
        assert ledger.matings > 50


def test_a_full_partition_heals(lan: Cabled) -> None:
    """All cables are out for 8 s, all are offline for each other; then all have their bodies again, and mate."""
    lan.settle()
    mended_s = time.monotonic() + 8.0
    for host in lan.hosts:
        host.cut()
    try:
        for robot in lan.colony.robots:
            robot.wait_for("the arena is offline", within_s=8.0)
        wait_until(lambda: not lan.view.alive(), "all robots are offline", 4.0)
        time.sleep(max(mended_s - time.monotonic(), 0.0))
    finally:
        for host in lan.hosts:
            host.mend()
    lan.settle()
    lan.view.wait_for_matings(8)


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_one_way_loss_slows_matings_and_breaks_none(lan: Cabled, share: float) -> None:
    """Half of the robots lose inbound packets: matings continue, and afterwards no encounter is open."""
    lan.settle()
    lan.lose(share, both_ways=False)
    try:
        counts = outcomes(lan, 2.0)
        lan.view.wait_for_matings(8)
    finally:
        lan.lose(0.0, both_ways=False)
    assert counts["orphaned"] == 0
    lan.settle()


def test_each_half_of_a_split_network_continues_by_itself(lan: Cabled) -> None:
    """Two robots keep the arena and mate, two wait for it; after healing all four are one colony again."""
    lan.settle()
    near, far = lan.colony.ids[:2], lan.colony.ids[2:]
    for host in lan.hosts[2:]:
        host.plug_into("right")
    try:
        wait_until(lambda: lan.view.alive() == set(near), "the far half is offline", 10.0)
        for robot in near:
            wait_until(lambda: lan.view.have_peers(near, 1), "each has one peer", 10.0)
            lan.view.wait_for_matings(2, robot)
    finally:
        for host in lan.hosts[2:]:
            host.plug_into("left")
    lan.settle()
    for robot in far:
        lan.view.wait_for_matings(2, robot)


def test_two_robots_that_lost_only_their_link_reconnect(lan: Cabled) -> None:
    """The link between two robots is lost while both keep the arena: they meet, and reconnect."""
    lan.settle()
    one, other = lan.colony.ids[:2]
    lan.hosts[0].ignore(lan.hosts[1])
    lan.hosts[1].ignore(lan.hosts[0])
    try:
        wait_until(
            lambda: lan.view.have_peers([one, other], 2), "each has all peers but the other", 10.0
        )
    finally:
        lan.hosts[0].lose(0.0)
        lan.hosts[1].lose(0.0)
    lan.settle()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_token_of_a_robot_that_failed_goes(lan: Cabled, fault: Fault) -> None:
    """At once if it crashed; after the lease of 3 s if it is frozen or cut off."""
    lan.settle()
    assert detection_s(lan, fault, 0) < (2.0 if fault.name == "kill -9" else 10.0)
    lan.settle()
