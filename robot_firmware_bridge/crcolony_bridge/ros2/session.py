"""A connection to the Zenoh router of ROS 2 robots, as one node among theirs."""

import itertools
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TypeVar

import zenoh

from crcolony.transport.close_session import close_session
from crcolony.transport.interface import NetworkError, NetworkUnavailableError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_samples import callback, declare_publisher, payload_bytes
from crcolony.transport.zenoh_session import open_session
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.ros2.cdr import CdrError, decode, encode
from crcolony_bridge.ros2.keys import (
    GID_BYTES,
    Endpoint,
    Node,
    RosType,
    all_tokens,
    attachment,
    parse_token,
    topic_key,
)

_T = TypeVar("_T")
_NODE_NAME = "crcolony_bridge"
_MAX_MESSAGE_BYTES = 1 << 20
"""A scan of ten thousand distances has 80 kB."""


@dataclass(frozen=True)
class Received:
    """The newest message of a topic. `number` is that of all that have come, from 1 on."""

    message: object
    received_s: float
    number: int


class Ros2Session:
    """A node on the network of the robots. Raises DeviceLostError, or DeviceError where a person has to do something.

    Messages and liveliness tokens arrive on threads of Zenoh, which only decode and keep the newest.
    """

    def __init__(self, endpoint: str, domain: int, namespace: str) -> None:
        try:
            self._session = open_session(NetworkSettings(role="client", connect=(endpoint,)))
        except NetworkUnavailableError as error:
            raise DeviceLostError(str(error)) from None
        except NetworkError as error:
            raise DeviceError(str(error)) from None
        self._endpoint = endpoint
        self._domain = domain
        self._node = Node(domain, str(self._session.zid()), _NODE_NAME, namespace)
        self._numbers = itertools.count(1)
        self._changed = threading.Condition()
        self._tokens: dict[str, Endpoint] = {}
        self._newest: dict[str, Received] = {}
        self.bad_messages = 0
        self._declared: list[object] = []
        """Zenoh undeclares what nobody holds any more"""
        try:
            self._join()
        except DeviceLostError:
            self.close()
            raise

    def subscribe(
        self,
        topic: str,
        ros_type: RosType,
        message_class: type[_T],
        is_valid: Callable[[_T], bool] = lambda _: True,
    ) -> None:
        """Keep the newest message of a topic; malformed ones, and those that are not valid, are counted."""

        def receive(sample: zenoh.Sample) -> None:
            try:
                message = decode(message_class, payload_bytes(sample.payload, _MAX_MESSAGE_BYTES))
            except CdrError:
                self.bad_messages += 1
                return
            if not is_valid(message):
                self.bad_messages += 1
                return
            with self._changed:
                before = self._newest.get(topic)
                number = before.number + 1 if before else 1
                self._newest[topic] = Received(message, time.monotonic(), number)
                self._changed.notify_all()

        key = topic_key(self._domain, topic, ros_type)
        with self._connected():
            self._declared.append(self._session.declare_subscriber(key, callback(receive)))
            self._declare_token(
                self._node.endpoint_token(next(self._numbers), "MS", topic, ros_type)
            )

    def publisher(self, topic: str, ros_type: RosType) -> "TopicPublisher":
        """Return a publisher of a topic."""
        with self._connected():
            publisher = declare_publisher(self._session, topic_key(self._domain, topic, ros_type))
            self._declare_token(
                self._node.endpoint_token(next(self._numbers), "MP", topic, ros_type)
            )
        return TopicPublisher(publisher)

    def newest(self, topic: str) -> Received | None:
        """Return the newest message of a topic that has come."""
        with self._changed:
            return self._newest.get(topic)

    def endpoints(self) -> list[Endpoint]:
        """Return the publishers and subscribers that are there now, ours too."""
        with self._changed:
            return list(self._tokens.values())

    def wait_until(self, is_met: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until a condition on messages and endpoints is met; return whether it is."""
        with self._changed:
            return self._changed.wait_for(is_met, timeout_s)

    def close(self) -> None:
        """Disconnect."""
        close_session(self._session)

    def _join(self) -> None:
        """Say that our node is there, and follow who else is."""
        with self._connected():
            self._declare_token(self._node.token)
            self._declared.append(
                self._session.liveliness().declare_subscriber(
                    all_tokens(self._domain), callback(self._follow_token), history=True
                )
            )

    @contextmanager
    def _connected(self) -> Iterator[None]:
        """A context that raises DeviceLostError for what Zenoh refuses."""
        try:
            yield
        except zenoh.ZError as error:
            reason = str(error).partition(" at /")[0]
            raise DeviceLostError(f"{self._endpoint}: {reason}") from None

    def _declare_token(self, token: str) -> None:
        self._declared.append(self._session.liveliness().declare_token(token))

    def _follow_token(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        endpoint = parse_token(token)
        with self._changed:
            if endpoint is not None and sample.kind == zenoh.SampleKind.PUT:
                self._tokens[token] = endpoint
            else:
                self._tokens.pop(token, None)
            self._changed.notify_all()


class TopicPublisher:
    """Publishes messages of one topic."""

    def __init__(self, publisher: zenoh.Publisher) -> None:
        self._publisher = publisher
        # rmw_zenoh derives this from the token; nothing compares the two.
        self._gid = secrets.token_bytes(GID_BYTES)
        self._sequence = itertools.count(1)

    def put(self, message: object) -> None:
        """Publish a message; without a link nothing happens."""
        beside = attachment(next(self._sequence), time.time_ns(), self._gid)
        with suppress(zenoh.ZError):  # closed meanwhile
            self._publisher.put(encode(message), attachment=beside)
