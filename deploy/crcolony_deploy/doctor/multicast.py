"""Whether peers can find each other by multicast on the interfaces that services use."""

import contextlib
import os
import socket
import struct
from collections.abc import Iterator

from crcolony.transport.interface import NetworkError
from crcolony.transport.reachability import address_of_interface
from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import HostState

_GROUP = "224.0.0.225"
"""Beside Zenoh's own 224.0.0.224, so that no peer is disturbed."""
_TIMEOUT_S = 1.0


def check_multicast(host: HostState) -> Iterator[Finding]:
    """Send a datagram to a group on each interface, and receive it there again."""
    interfaces = {service.value("--interface") for service in host.services} - {""}
    for interface in sorted(interfaces):
        try:
            address = address_of_interface(interface)
        except NetworkError as error:
            yield problem(
                str(error), "ip -4 address shows what there is; crcolony_interface names it"
            )
            continue
        if reason := _reason_unheard(address):
            yield problem(
                f"multicast on {interface} does not work: {reason}",
                "allow UDP to 224.0.0.224 port 7446 in the firewall, or use crcolony_topology: seeds",
            )
        else:
            yield ok(f"multicast works on {interface} ({address})")
            if not host.colony.is_linked and not host.colony.problem and len(host.services) < 2:
                yield warning(
                    f"nobody answers on {interface}",
                    "are the others on, in the same network? Wi-Fi and switches may filter multicast:"
                    " crcolony_topology: seeds does without",
                )


def _reason_unheard(address: str) -> str:
    """Return why a datagram to a group is not received on the interface with this address; empty if it is."""
    probe = os.urandom(16)
    try:
        with contextlib.ExitStack() as opened:
            receiver = opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            receiver.bind((_GROUP, 0))
            member = struct.pack("4s4s", socket.inet_aton(_GROUP), socket.inet_aton(address))
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            receiver.settimeout(_TIMEOUT_S)
            sender = opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
            sender.sendto(probe, (_GROUP, receiver.getsockname()[1]))
            return "" if receiver.recv(64) == probe else "another datagram came"
    except TimeoutError:
        return "a datagram to a group does not come back"
    except OSError as error:
        return error.strerror or str(error)
