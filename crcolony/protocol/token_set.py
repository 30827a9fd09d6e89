"""The liveliness tokens of robots and arenas: a robot is online as long as one of its tokens is on the network."""

from collections.abc import Iterator

from crcolony.protocol.identity import RobotId

Token = tuple[int, str]
"""Incarnation of a robot (of an arena: its run), and the session of the process that declared the token"""

MAX_TOKENS = 100
"""Anyone can declare tokens in the name of a robot: further ones are ignored."""


class TokenSet:
    """The tokens of one robot or arena, in the order in which they were declared."""

    def __init__(self) -> None:
        self._tokens: dict[Token, None] = {}

    def add(self, token: Token) -> bool:
        """Add a token that was declared; return whether its owner was offline and now is online."""
        if self.is_full:
            return False
        was_online = self.is_online
        self._tokens[token] = None
        return not was_online

    def remove(self, token: Token) -> bool:
        """Remove a token that was undeclared; return whether its owner was online and now is offline."""
        was_online = self.is_online
        self._tokens.pop(token, None)
        return was_online and not self.is_online

    @property
    def is_online(self) -> bool:
        """Whether there is a token."""
        return bool(self._tokens)

    @property
    def is_full(self) -> bool:
        """Whether a further token would be ignored."""
        return len(self._tokens) >= MAX_TOKENS

    def __len__(self) -> int:
        return len(self._tokens)

    def __iter__(self) -> Iterator[Token]:
        return iter(self._tokens)


class TokenTable:
    """The robots that are online, each with its tokens."""

    def __init__(self) -> None:
        self._robots: dict[RobotId, TokenSet] = {}

    def add(self, robot: RobotId, token: Token) -> bool:
        """Add a token that was declared; return whether the robot was offline and now is online."""
        return self._robots.setdefault(robot, TokenSet()).add(token)

    def remove(self, robot: RobotId, token: Token) -> bool:
        """Remove a token that was undeclared; return whether the robot was online and now is offline."""
        tokens = self._robots.get(robot)
        if tokens is None or not tokens.remove(token):
            return False
        del self._robots[robot]
        return True

    def __contains__(self, robot: RobotId) -> bool:
        return robot in self._robots

    def __len__(self) -> int:
        return len(self._robots)

    def __iter__(self) -> Iterator[RobotId]:
        return iter(self._robots)
