"""Hosts for the doctor: with services, an own view of their colony, and commands that answer as told."""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest
from crcolony_deploy.doctor.colony_view import ColonyView
from crcolony_deploy.doctor.finding import Finding
from crcolony_deploy.doctor.host_state import HostState
from crcolony_deploy.doctor.installed_services import InstalledService

from crcolony.protocol.telemetry_messages import RobotState
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.transport.network_settings import NetworkSettings

ADA, BOB = b"a" * 16, b"b" * 16


def service(kind: str, name: str, options: str = "") -> InstalledService:
    """Return a service with these options."""
    return InstalledService(kind, name, tuple(options.split()))


def host_of(
    folder: Path,
    *services: InstalledService,
    colony: ColonyView | None = None,
    own: Mapping[str, bytes] | None = None,
    network: NetworkSettings | None = None,
) -> HostState:
    """Return a host whose folders are in this one, with what it receives of its colony."""
    host = HostState(
        services,
        network or NetworkSettings(),
        state_folder=folder,
        cache_folder=folder / "cache",
        current=folder / "current",
        proc=folder / "proc",
    )
    # what would be received, or read from keys, is known already
    host.__dict__["colony"] = colony or ColonyView()
    host.__dict__["own_robots"] = dict(own or {})
    return host


def online(robot: bytes, arena: str, colony: str = "reef", sessions: int = 1) -> RobotStatus:
    """Return a robot that is online, with a body in an arena ("": with none)."""
    status = RobotStatus(robot, colony)
    for number in range(sessions):
        status.tokens.add((1, f"session{number}"))
    status.state = RobotState(
        robot=robot, number=0, arena=arena, incarnation=1, seq=0, unix_ms=0, tick=0, generation=0,
        agent="a", energy=1.0, module=0, matings=0, conceptions=0, captures=0, pool=0, waiting=0,
        doubts=0, orphaned=0, peers=0, refused=0, dropped=0, faults=0, period_ms=100.0,
    )  # fmt: skip
    return status


def arena_online(name: str, runs: int) -> ArenaStatus:
    """Return an arena of which so many runs are online."""
    arena = ArenaStatus(name)
    for number in range(runs):
        arena.tokens.add((number, f"session{number}"))
    return arena


def answer(monkeypatch: pytest.MonkeyPatch, folder: Path, command: str, output: str) -> None:
    """Put a command first in the path that prints an output."""
    binaries = folder / "bin"
    binaries.mkdir(exist_ok=True)
    path = binaries / command
    path.write_text(f"#!/bin/sh\ncat <<'END'\n{output}\nEND\n")
    path.chmod(0o755)
    if not os.environ["PATH"].startswith(f"{binaries}:"):
        monkeypatch.setenv("PATH", f"{binaries}:{os.environ['PATH']}")


def lines(findings: Iterable[Finding]) -> list[str]:
    """Return level and text of findings."""
    return [f"{finding.level}: {finding.what}" for finding in findings]
