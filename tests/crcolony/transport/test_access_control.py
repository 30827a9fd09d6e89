"""What a member may say follows from its entry in the roster, and everything else is denied."""

import json
from collections.abc import Iterator

import pytest
import zenoh

from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys, roster_key
from crcolony.protocol.roster import Member, Roster
from crcolony.transport.access_control import access_control

ROBOT, OTHER = bytes([1]) * 16, bytes([2]) * 16
LAB, LAB_ARENA, DESK = ColonyKeys("lab"), ArenaKeys("floor"), ArenaKeys("desk")
ROSTER = Roster(
    "lab",
    3,
    (
        Member("robot", "kitchen", (ROBOT,)),
        Member("robot", "lost", (OTHER,), is_revoked=True),
        Member("host", "big", (bytes([3]) * 16, bytes([4]) * 16), ("hall",)),
        Member("arena", "main", arenas=("floor",)),
        Member("bridge", "desk", arenas=("desk",)),
        Member("router", "north"),
        Member("observer", "wall"),
        Member("operator", "me"),
    ),
)


def is_allowed(name: str, message: str, key: str, *, by_client: bool = False) -> bool:
    """Return whether a member's message reaches others, as Zenoh decides: a rule's key includes that of the message."""
    section = access_control(ROSTER, trusts_only_routers=by_client)
    assert section["enabled"] is True
    assert section["default_permission"] == "deny"
    subjects = {"everyone", name} & {subject["id"] for subject in section["subjects"]}
    named = {
        rule
        for policy in section["policies"]
        if subjects & set(policy["subjects"])
        for rule in policy["rules"]
    }
    return any(
        message in rule["messages"]
        and "ingress" in rule["flows"]
        and any(zenoh.KeyExpr(one).includes(zenoh.KeyExpr(key)) for one in rule["key_exprs"])
        for rule in section["rules"]
        if rule["id"] in named
    )


def test_a_robot_may_what_its_life_needs() -> None:
    """Its state and action, letters to everybody, its token, its body, and answers about itself."""
    for message, key in (
        ("put", LAB.inbox(OTHER)),
        ("put", LAB.state(ROBOT)),
        ("put", LAB_ARENA.action(ROBOT)),
        ("query", LAB_ARENA.join(ROBOT)),
        ("liveliness_token", LAB.alive(ROBOT, 7, "a1")),
        ("declare_queryable", LAB.history(ROBOT)),
        ("declare_subscriber", LAB_ARENA.observation(ROBOT)),
        ("declare_liveliness_subscriber", LAB.all_alive),
        ("declare_liveliness_subscriber", LAB.all_versions),
        ("put", roster_key("lab")),
    ):
        assert is_allowed("robot.kitchen", message, key), (message, key)


def test_a_robot_may_nothing_of_others() -> None:
    """Neither under another robot's id, nor an arena's, nor under a wildcard that includes them."""
    for message, key in (
        ("put", LAB.state(OTHER)),
        ("put", LAB.all_states),
        ("put", LAB_ARENA.action(OTHER)),
        ("put", LAB_ARENA.all_actions),
        ("put", LAB_ARENA.observation(ROBOT)),
        ("put", LAB_ARENA.scene),
        ("query", LAB_ARENA.join(OTHER)),
        ("query", LAB_ARENA.all_joins),
        ("query", LAB_ARENA.stop),
        ("query", LAB.history(OTHER)),
        ("liveliness_token", LAB.alive(OTHER, 7, "a1")),
        ("liveliness_token", LAB_ARENA.alive(7, "a1")),
        ("declare_queryable", LAB.history(OTHER)),
        ("declare_queryable", LAB_ARENA.all_joins),
        ("declare_subscriber", LAB.inbox(OTHER)),
        ("declare_subscriber", LAB.all_inboxes),
        ("declare_subscriber", "**"),
        ("put", ColonyKeys("other").state(ROBOT)),
    ):
        assert not is_allowed("robot.kitchen", message, key), (message, key)


@pytest.mark.parametrize("name", ["robot.lost", "robot.stranger", "everyone"])
def test_who_is_revoked_or_unknown_may_only_pass_on_the_roster(name: str) -> None:
    """It is signed, so that it does not matter who passes it on."""
    assert is_allowed(name, "put", roster_key("lab"))
    for message, key in (
        ("put", LAB.inbox(ROBOT)),
        ("put", LAB.state(OTHER)),
        ("liveliness_token", LAB.alive(OTHER, 7, "a1")),
        ("query", LAB_ARENA.join(OTHER)),
        ("declare_subscriber", LAB.all_states),
    ):
        assert not is_allowed(name, message, key), (message, key)


def test_an_arena_carries_its_own_bodies_alone() -> None:
    """Those of another arena are not its."""
    for keys, expected in ((LAB_ARENA, True), (DESK, False)):
        for message, key in (
            ("put", keys.observation(ROBOT)),
            ("put", keys.scene),
            ("declare_queryable", keys.all_joins),
            ("declare_subscriber", keys.all_actions),
            ("liveliness_token", keys.alive(7, "a1")),
        ):
            assert is_allowed("arena.main", message, key) is expected, (message, key)
    assert not is_allowed("arena.main", "put", LAB.inbox(ROBOT))


def test_a_bridge_stands_in_for_robots_under_an_older_token() -> None:
    """Of incarnation 0, which no robot has: it does not silence one."""
    assert is_allowed("bridge.desk", "put", LAB.inbox(ROBOT))
    assert is_allowed("bridge.desk", "liveliness_token", LAB.alive(ROBOT, 0, "a1"))
    assert not is_allowed("bridge.desk", "liveliness_token", LAB.alive(ROBOT, 1, "a1"))


def test_an_observer_asks_and_listens_and_an_operator_also_stops() -> None:
    """Neither says anything in the name of a robot or an arena."""
    for name in ("observer.wall", "operator.me"):
        assert is_allowed(name, "declare_subscriber", ColonyKeys("*").all_states)
        assert is_allowed(name, "query", LAB.history(ROBOT))
        assert not is_allowed(name, "put", LAB.state(ROBOT))
        assert not is_allowed(name, "declare_subscriber", LAB.all_inboxes)
    assert is_allowed("operator.me", "query", ArenaKeys("*").stop)
    assert not is_allowed("observer.wall", "query", ArenaKeys("*").stop)


def test_a_client_trusts_routers_alone() -> None:
    """They pass on what they have checked, so that a client needs no entry for every robot."""
    assert is_allowed("router.north", "put", LAB.state(ROBOT), by_client=True)
    assert not is_allowed("robot.kitchen", "put", LAB.state(ROBOT), by_client=True)
    few = access_control(ROSTER, trusts_only_routers=True)
    assert len(few["rules"]) < len(access_control(ROSTER)["rules"])


@pytest.fixture
def session() -> Iterator[zenoh.Session]:
    """A session with this access control."""
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("access_control", json.dumps(access_control(ROSTER)))
    with zenoh.open(config) as opened:
        yield opened


def test_zenoh_accepts_it(session: zenoh.Session) -> None:
    """Every rule, subject and policy."""
    assert not session.is_closed()
