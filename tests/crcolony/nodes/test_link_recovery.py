"""A link that is lost for one robot alone is found by meetings and by the arena's scene."""

import pytest

from crcolony.nodes.link_recovery import LinkRecovery
from tests.support.lone_robot import COLONY, ME, PEER, scene_of


@pytest.fixture
def links() -> LinkRecovery:
    """The suspects of the robot with the smaller id."""
    return LinkRecovery(ME.id, COLONY)


def test_a_robot_met_for_5_s_without_being_online_is_a_reason_to_reconnect(
    links: LinkRecovery,
) -> None:
    """One that is online, or comes online meanwhile, is none."""
    assert links.handle_contact(0.0, PEER.id, is_online=False) is None
    assert links.handle_contact(4.9, PEER.id, is_online=False) is None
    links.handle_online(PEER.id)
    assert links.handle_contact(5.0, PEER.id, is_online=False) is None
    assert links.handle_contact(9.9, PEER.id, is_online=True) is None
    assert links.handle_contact(10.0, PEER.id, is_online=False) is None
    reason = links.handle_contact(15.0, PEER.id, is_online=False)
    assert reason == f"robot {PEER.id.hex()[:8]} was met and is not online"


def test_a_reason_is_given_every_30_s_at_most(links: LinkRecovery) -> None:
    """However often the robot is met."""
    times = [0.1 * k for k in range(640) if links.handle_contact(0.1 * k, PEER.id, is_online=False)]
    assert times == pytest.approx([5.0, 35.0])


def test_a_robot_that_went_offline_and_acts_is_a_reason_to_reconnect(links: LinkRecovery) -> None:
    """After 5 s, if its lamp is lit; a robot of another colony is none."""
    links.handle_offline(0.0, PEER.id)
    assert links.needs_scene
    assert links.handle_scene(4.9, scene_of(PEER.id, is_lit=True)) is None
    assert links.handle_scene(5.0, scene_of(PEER.id, is_lit=False)) is None
    assert links.handle_scene(5.0, scene_of(PEER.id, is_lit=True, colony="red")) is None
    assert links.handle_scene(5.0, scene_of(PEER.id, is_lit=True)) is not None


def test_a_robot_does_not_suspect_itself(links: LinkRecovery) -> None:
    """A token of its own goes whenever its session is renewed; it would reconnect for nothing."""
    links.handle_offline(0.0, ME.id)
    assert not links.needs_scene
    assert links.handle_scene(100.0, scene_of(ME.id, is_lit=True)) is None


def test_the_robot_with_the_larger_id_waits_three_times_as_long() -> None:
    """So that only one of the two reconnects."""
    links = LinkRecovery(PEER.id, COLONY)
    links.handle_offline(0.0, ME.id)
    assert links.handle_scene(14.9, scene_of(ME.id, is_lit=True)) is None
    assert links.handle_scene(15.0, scene_of(ME.id, is_lit=True)) is not None


def test_robots_that_have_been_offline_for_long_are_given_up(links: LinkRecovery) -> None:
    """After 300 s the scene is not needed any more."""
    links.handle_offline(0.0, PEER.id)
    links.remove_expired(300.0)
    assert links.needs_scene
    links.remove_expired(300.1)
    assert not links.needs_scene
    assert links.handle_scene(400.0, scene_of(PEER.id, is_lit=True)) is None


def test_the_number_of_suspects_is_bounded(links: LinkRecovery) -> None:
    """Ids can be made up without end."""
    for number in range(3000):
        robot = number.to_bytes(16)
        links.handle_offline(0.0, robot)
        links.handle_contact(0.0, robot, is_online=False)
    assert len(links._offline) == 1000
    assert len(links._met) <= 1000
