"""Zenoh's access control of a deployment, from its roster: a member publishes under its own id alone.

It is in force on every link, in both directions of connecting, by the common name of the certificate at the other end.
What is not allowed is denied: a member without an entry, or a revoked one, is connected to nobody's keys.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import (
    ROOT,
    ArenaKeys,
    ColonyKeys,
    observer,
    roster_key,
    roster_serial_key,
)
from crcolony.protocol.roster import Member, Roster

_PUBLISH = ("put", "delete")
_QUERY = ("query",)
_SERVE = ("declare_queryable", "reply")
_SUBSCRIBE = ("declare_subscriber",)
_TOKEN = ("liveliness_token",)
_WATCH = ("liveliness_query", "declare_liveliness_subscriber")
_ALL = (*_PUBLISH, *_QUERY, *_SERVE, *_SUBSCRIBE, *_TOKEN, *_WATCH)
"""Every kind of message that Zenoh's access control knows."""


class Permission(NamedTuple):
    """Some kinds of messages that are allowed on some keys."""

    messages: tuple[str, ...]
    keys: tuple[str, ...]


def access_control(roster: Roster, *, trusts_only_routers: bool = False) -> dict[str, Any]:
    """Return the section `access_control` of Zenoh's configuration, for any member of the deployment.

    A client `trusts_only_routers`, which have checked the messages of the others before they pass them on.
    """
    rules = [
        _rule("everyone", Permission(_ALL, ("**",)), "egress"),
        *(
            _rule(f"everyone {number}", permission)
            for number, permission in enumerate(_of_everyone(roster.colony))
        ),
    ]
    subjects: list[dict[str, Any]] = [{"id": "everyone"}]
    policies = [{"rules": [rule["id"] for rule in rules], "subjects": ["everyone"]}]
    for member in roster.admitted:
        if trusts_only_routers and member.role != "router":
            continue
        name = member.common_name
        own = [
            _rule(f"{name} {number}", permission)
            for number, permission in enumerate(permissions_of(member, roster.colony))
        ]
        rules += own
        subjects.append({"id": name, "cert_common_names": [name]})
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [name]})
    return {
        "enabled": True,  # without it Zenoh reads the rest and does nothing
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def permissions_of(member: Member, colony: str) -> Iterator[Permission]:
    """Yield what a member may send to others, beyond what everyone may."""
    if member.role == "router":
        yield Permission(_ALL, ("**",))
    for robot in member.robots:
        yield from _of_robot(robot, ColonyKeys(colony))
    for arena in member.arenas:
        yield from _of_arena(ArenaKeys(arena))
    if member.role == "bridge":
        yield from _of_relay(ColonyKeys(colony))
    if member.role in ("observer", "operator"):
        yield from _of_observer()
    if member.role == "operator":
        yield Permission(_QUERY, (ArenaKeys("*").stop,))


def _of_everyone(colony: str) -> Iterator[Permission]:
    """Yield what every certified process may send: the roster, which is signed, and what says that it is there."""
    keys = (roster_key(colony), roster_serial_key(colony))
    yield Permission((*_PUBLISH, *_QUERY, *_SERVE, *_SUBSCRIBE), keys)
    yield Permission(_WATCH, (f"{ROOT}/**", f"crcolony/*/colony/{colony}/alive/*/*/*"))
    yield Permission(_TOKEN, (observer("*"),))


def _of_robot(robot: RobotId, colony: ColonyKeys) -> Iterator[Permission]:
    bodies = ArenaKeys("*")
    yield Permission(
        _PUBLISH,
        (
            colony.all_inboxes,
            colony.state(robot),
            colony.event(robot),
            colony.activity(robot),
            bodies.action(robot),
        ),
    )
    yield Permission(_TOKEN, (colony.alive_of(robot),))
    yield Permission(_QUERY, (bodies.join(robot), bodies.metadata))
    yield Permission(_SERVE, (colony.history(robot), colony.metadata(robot)))
    yield Permission(_SUBSCRIBE, (colony.inbox(robot), bodies.observation(robot), bodies.scene))


def _of_arena(arena: ArenaKeys) -> Iterator[Permission]:
    yield Permission(_PUBLISH, (arena.all_observations, arena.scene, arena.activity))
    yield Permission(_TOKEN, (arena.all_alive, arena.stoppable("*")))
    yield Permission(_SERVE, (arena.all_joins, arena.metadata, arena.stop))
    yield Permission(_SUBSCRIBE, (arena.all_actions,))


def _of_relay(colony: ColonyKeys) -> Iterator[Permission]:
    """Yield what a bridge needs to stand in for robots that are met by infrared, under a token older than theirs."""
    yield Permission((*_PUBLISH, *_SUBSCRIBE), (colony.all_inboxes,))
    yield Permission(_TOKEN, (colony.stand_in,))


def _of_observer() -> Iterator[Permission]:
    colonies, arenas = ColonyKeys("*"), ArenaKeys("*")
    yield Permission(
        _SUBSCRIBE,
        (
            colonies.all_states,
            colonies.all_events,
            colonies.all_activities,
            arenas.scene,
            arenas.activity,
        ),
    )
    yield Permission(_QUERY, (colonies.all_histories, colonies.all_metadata, arenas.metadata))


def _rule(name: str, permission: Permission, flow: str = "ingress") -> dict[str, Any]:
    return {
        "id": name,
        "messages": list(permission.messages),
        "flows": [flow],
        "permission": "allow",
        "key_exprs": list(permission.keys),
    }
