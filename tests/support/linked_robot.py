"""The robot's end of a link to a body, for tests and benchmarks of arenas and bridges."""

import secrets

from crcolony.nodes.link_to_body import LinkToBody
from crcolony.nodes.node_inputs import ColonyMember, FirstArenas
from crcolony.protocol.body_messages import Action, BodyDenied, BodyGranted, Join, Leave
from crcolony.protocol.body_requests import sign_request
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import Identity
from crcolony.protocol.link_keys import LinkKeys, seal
from crcolony.transport.interface import NoLinkOnThisMachine


class LinkedRobot:
    """A robot with a key that asks for a body in one run of an arena."""

    def __init__(
        self, identity: Identity, arena: str, arena_run: int, colony: str = "test", slot: int = -1
    ) -> None:
        self.identity, self.id = identity, identity.id
        self._arena, self._arena_run = arena, arena_run
        member = ColonyMember(identity, colony, 0, 1)
        self.link = LinkToBody(
            member,
            arena,
            slot,
            FirstArenas(),
            secrets.token_bytes,
            lambda robot, action: None,
            NoLinkOnThisMachine(),
        )
        self.link.handle_online(arena_run)

    def request(self) -> bytes:
        """Return its request for a body."""
        request = self.link.request()
        assert request is not None
        return request

    def reply(self, data: bytes) -> BodyGranted | BodyDenied:
        """Handle a reply, and return it."""
        reply = self.link.open_reply(data)
        assert reply is not None
        return reply

    def leave(self) -> bytes:
        """Return the request to leave, of a robot that has no body as well."""
        message = Leave(self.id, self._arena_run, 1, 10**6)
        return sign_request(message, self._arena, self.identity)

    @property
    def keys(self) -> LinkKeys:
        """The keys of its link."""
        return self.link._keys

    def seal(self, action: Action) -> bytes:
        """Return an action as it is sent."""
        return seal(self.keys.actions, encode(action))


def forged_join(robot: bytes, colony: str, slot: int, arena_run: int) -> bytes:
    """Return what somebody without the robot's key can say in its name."""
    stranger = Identity(secrets.token_bytes(32))
    join = Join(robot, colony, slot, arena_run, 2**32 - 1, 1, secrets.token_bytes(32))
    return sign_request(join, "arena", stranger)


def forged_leave(robot: bytes, arena_run: int = 0) -> bytes:
    """Return what somebody without the robot's key can say in its name."""
    stranger = Identity(secrets.token_bytes(32))
    return sign_request(Leave(robot, arena_run, 2**32 - 1, 1), "arena", stranger)
