"""Secrets of a deployment stay in their files: keys of robots, of certificates, of the authority, and PINs."""

import base64
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from cryptography.hazmat.primitives import serialization

from crcolony.transport.brief_session import brief_session
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port
from tests.support.command_line import run_command
from tests.support.process_colony import Colony, colony
from tests.support.spy import Spy

SECRET_FILES = {"key", "identity.pem", "authority.key", "next_key.pem"}


class EnrolledColony:
    """A colony whose members were enrolled with the commands that people use, by PIN and by file."""

    def __init__(self, made: Colony) -> None:
        self.made, self.folder = made, made.folder
        self.pins: list[str] = []
        self.authority = self.folder / "authority"
        self.printed = self.folder / "printed"
        """What commands have printed that end, but for the invitations, which are to be seen once"""
        made.endpoint = made.endpoint.replace("tcp/", "tls/")
        self.run("authority", "create", self.authority, "--colony", "colony")
        self.at = f"127.0.0.1:{free_port()}"
        service = made.start(
            "authority", "authority", "serve", str(self.authority), "--at", self.at
        )
        service.wait_for("authority of colony")

    def run(self, *words: str | Path, returns: int = 0) -> None:
        """Run a command to its end, and keep what it prints."""
        done = run_command(*words)
        assert done.returncode == returns, done.stderr
        with self.printed.open("a") as file:
            file.write(done.stdout + done.stderr)

    def enroll(self, role: str, name: str, *options: str | Path) -> Path:
        """Enroll a member with an invitation."""
        out = self.folder / f"{role}.{name}"
        words = ("enroll", role, name, *options, "--out", out, "--at", self.at)
        self.run(*words, "--invitation", self._invitation(role, name))
        return out

    def enroll_late(self, role: str, name: str) -> None:
        """Attempt it with a PIN of another member, which is refused."""
        self._invitation(role, name)
        words = ("enroll", role, name, "--out", self.folder / name, "--at", self.at)
        other = self._invitation("operator", "nobody")
        self.run(*words, "--invitation", other, returns=2)

    def enroll_by_file(self, name: str, key: Path) -> Path:
        """Enroll a robot whose request and grant are carried."""
        out, request = self.folder / f"robot.{name}", self.folder / f"{name}.request"
        grant = self.folder / f"{name}.grant"
        self.run("enroll", "robot", name, "--key", key, "--out", out, "--request", request)
        self.run("authority", "issue", self.authority, request, grant)
        self.run("enroll", "--install", grant, "--out", out)
        return out

    def _invitation(self, role: str, name: str) -> str:
        output = run_command("authority", "invite", self.authority, role, name).stdout
        invitation = output.partition("--invitation ")[2].strip()
        self.pins.append(invitation.partition("-")[0])
        return invitation

    def secrets(self) -> Iterator[bytes]:
        """Yield every secret, in every form in which it could be written."""
        for path in self.folder.rglob("*"):
            if path.name in ("key", "authority.key"):
                yield from forms(bytes.fromhex(path.read_text()))
            elif path.name == "identity.pem":
                key = serialization.load_pem_private_key(path.read_bytes(), None)
                raw = (
                    serialization.Encoding.Raw,
                    serialization.PrivateFormat.Raw,
                    serialization.NoEncryption(),
                )
                yield from forms(key.private_bytes(*raw))
                yield path.read_bytes().splitlines()[1]  # of the key, in PEM


def forms(secret: bytes) -> Iterator[bytes]:
    """Yield a secret as it is, as hex, and as base64."""
    yield from (secret, secret.hex().encode(), base64.b64encode(secret))


def files_in(folder: Path) -> dict[Path, bytes]:
    """Return all files with their content."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def lived(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EnrolledColony]:
    """A colony that has mated, was watched, renewed a certificate, and revoked a robot; its services still run."""
    folder = tmp_path_factory.mktemp("lived")
    with pytest.MonkeyPatch.context() as patch, colony(folder) as made:
        (folder / "temporary").mkdir()
        patch.setenv("TMPDIR", str(folder / "temporary"))
        enrolled = EnrolledColony(made)
        arena = enrolled.enroll("arena", "main", "--arena", "arena")
        wall, me = enrolled.enroll("observer", "wall"), enrolled.enroll("operator", "me")
        router = enrolled.enroll("router", "spy")
        enrolled.enroll_late("observer", "late")
        robots = [folder / name for name in ("ada", "bob")]
        for robot in robots:
            enrolled.run("keygen", robot / "key")
        ada = enrolled.enroll("robot", "ada", "--key", robots[0] / "key")
        bob = enrolled.enroll_by_file("bob", robots[1] / "key")
        json_log = ("--log-format", "json")
        made.arena(2, "--hz", "20", "--credentials", str(arena), *json_log)
        made.robot("--credentials", str(ada), *json_log, folder=robots[0])
        made.robot("--credentials", str(bob), folder=robots[1])
        network = NetworkSettings(connect=(made.endpoint,), credentials=router)
        with brief_session(network) as session:
            spy = Spy(session)
            made.observer("--credentials", str(wall)).wait_for_matings(4)
            reach = ("--connect", made.endpoint, "--credentials", wall)
            enrolled.run("metrics", *reach)
            enrolled.run("status", "--json", *reach)
            enrolled.run("enroll", "--renew", "--out", bob, "--at", enrolled.at)
            as_operator = ("--connect", made.endpoint, "--credentials", me)
            enrolled.run("authority", "revoke", enrolled.authority, "ada", *as_operator)
            enrolled.run("doctor", "--services", folder, "--credentials", wall, "--only", "access")
        said = b"\n".join(key.encode() + b" " + payload for key, payload in sorted(spy.heard))
        (folder / "telemetry").write_bytes(said)
        yield enrolled


def test_keys_are_in_their_files_alone(lived: EnrolledColony) -> None:
    """Not in logs, telemetry, metrics, rosters, requests, grants, audit logs, memories, nor what commands print."""
    secrets = sorted(set(lived.secrets()))
    assert len(secrets) >= 3 * (2 + 1) + 4 * 6
    files = files_in(lived.folder)
    names = {path.name for path in files}
    expected = {"telemetry", "printed", "audit.jsonl", "roster", "bob.request", "bob.grant"}
    assert expected | {"robot.sqlite", "arena.log", "authority.log", "invitations.json"} <= names
    assert b"crcolony_robot_matings_total" in files[lived.printed]
    assert b"/state/" in files[lived.folder / "telemetry"]
    for path, content in files.items():
        if path.name not in SECRET_FILES:
            assert not [secret for secret in secrets if secret in content], path


def test_files_with_keys_are_for_their_owner_alone(lived: EnrolledColony) -> None:
    """Also such as are written for a moment, and whatever else has a secret key of any kind; so is the authority."""
    assert lived.authority.stat().st_mode & 0o777 == 0o700
    secrets = set(lived.secrets())
    holding = [
        path
        for path, content in files_in(lived.folder).items()
        if b"PRIVATE KEY" in content or any(secret in content for secret in secrets)
    ]
    assert {path.name for path in holding} >= {"key", "identity.pem", "authority.key"}
    for path in holding:
        parents = [one for one in path.parents if lived.folder in one.parents]
        is_closed = any(one.stat().st_mode & 0o077 == 0 for one in parents)
        assert path.stat().st_mode & 0o077 == 0 or is_closed, path


def test_pins_are_seen_once(lived: EnrolledColony) -> None:
    """Used, wrong, or still open: they stand in no file and no log, only a slow hash of them does."""
    assert len(lived.pins) == len(set(lived.pins)) == 7
    for path, content in files_in(lived.folder).items():
        for pin in lived.pins:
            assert not re.search(rb"(?<!\d)%s(?!\d)" % pin.encode(), content), path


def test_what_is_looked_for_would_be_found(lived: EnrolledColony, tmp_path: Path) -> None:
    """In a file that has a key in any form among other things."""
    for number, secret in enumerate(lived.secrets()):
        (tmp_path / f"log{number}").write_bytes(b"said " + secret + b" aloud")
    found = files_in(tmp_path)
    assert len(found) > 20
    assert all(any(one in content for one in lived.secrets()) for content in found.values())
