"""From an inventory to a running colony on four machines, with their own systemd and sshd, and what can go wrong there.

A person sees the same with `make demo-lan`.
"""

import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.support import namespaces
from tests.support.deployment import Deployment as CertifiedColony
from tests.support.lan_deployment import SEED, Deployment, changed_checkout, deployment
from tests.support.machines import Machine, machines, needs_machines
from tests.support.paths import ROOT
from tests.support.process import Process, wait_until
from tests.support.process_colony import settings

pytestmark = [needs_machines, pytest.mark.timeout(900)]

ROBOTS = ("ada", "bob", "eve")
NAMES = ("field", *ROBOTS)


class Show:
    """Says what happens, and when."""

    def __init__(self) -> None:
        self._started_s = time.monotonic()

    def say(self, line: str) -> None:
        """Print a line with the time since the start."""
        print(f"{time.monotonic() - self._started_s:5.0f} s  {line}", flush=True)


@pytest.fixture
def made(tmp_path: Path) -> Iterator[Deployment]:
    """Four machines that are on, with empty disks, and a laptop; all of it is gone at the end."""
    with machines(tmp_path, NAMES) as lan, deployment(lan, tmp_path) as made:
        made.hosts = {
            machine.name: {"ansible_host": machine.host.address} for machine in lan.machines
        }
        made.hosts["field"]["crcolony_arenas"] = [{"name": "pond", "robots": 4, "speed": 3}]
        for name in ROBOTS:
            made.hosts[name]["crcolony_robots"] = [name]
        yield made


def test_a_lan_from_an_inventory_to_a_colony_and_back(made: Deployment) -> None:
    """The acts of the show, in order: each goes on where the one before has ended."""
    show, lan = Show(), made.lan
    collected = ThreadPoolExecutor(1).submit(made.collect, ROOT, "wheelhouse")
    wrong_inventories_touch_nothing(made, show)
    version = collected.result()
    show.say(f"four machines are on; the wheelhouse has {version}")
    hosts_that_cannot_be_set_up_hold_nobody_else_up(made, show)
    the_playbook_makes_a_colony(made, show)
    the_second_run_changes_nothing(made, show)
    nothing_secret_is_readable(made, show)
    later = collected_meanwhile(made)
    a_guest_enrolls_and_is_revoked(made, show)
    a_hung_robot_is_restarted(lan.by_name("eve"), show)
    a_host_is_cut_off_and_comes_back(made, show)
    a_host_is_rebooted(made, show)
    a_host_is_replaced(made, show)
    a_broken_version_is_rolled_back(made, show, version, later["broken"].result())
    a_good_version_is_rolled_out(made, show, later["good"].result())
    uninstalling_leaves_nothing(made, show)


def collected_meanwhile(made: Deployment) -> dict[str, Future[str]]:
    """Collect two later versions while the laptop has nothing else to do; one of them fails at its start."""
    pool = ThreadPoolExecutor(1)
    return {
        name: pool.submit(_collect, made, name, version)
        for name, version in (("broken", "0.99.1"), ("good", "0.99.2"))
    }


def _collect(made: Deployment, name: str, version: str) -> str:
    source = changed_checkout(made.folder / name, version, is_broken=name == "broken")
    return made.collect(source, f"wheelhouse-{name}")


def is_untouched(machine: Machine) -> bool:
    """Return whether nothing of crcolony is on a machine."""
    paths = ("/etc/crcolony", "/var/lib/crcolony", "/var/cache/crcolony")
    found = machine.run("ls", "-d", "/opt/crcolony/versions", *paths, check=False)
    units = machine.run("sh", "-c", "ls -d /etc/systemd/system/crcolony* || true")
    user = machine.run("getent", "passwd", "crcolony", check=False)
    return not (found + units + user).strip()


def wrong_inventories_touch_nothing(made: Deployment, show: Show) -> None:
    """A typo, a name twice: what is wrong is said, and no host is asked anything."""
    typo = made.hosts | {"ada": made.hosts["ada"] | {"crcolony_seeds": ["feild"]}}
    twice = made.hosts | {"bob": made.hosts["bob"] | {"crcolony_robots": ["ada"]}}
    for hosts, what in (
        (typo, "host ada: crcolony_seeds: there is no host feild; did you mean field?"),
        (twice, "host bob: robot ada is also on ada"),
    ):
        made.write(hosts)
        played = made.play("site")
        assert played.code != 0
        assert what in played.output
        assert all(map(is_untouched, made.lan.machines))
        show.say(f"refused: {what}")


def hosts_that_cannot_be_set_up_hold_nobody_else_up(made: Deployment, show: Show) -> None:
    """Each is told what is wrong with it and left as it was; the arena's host, with which all is well, is set up."""
    ada, bob, eve = map(made.lan.by_name, ROBOTS)
    fake = 'exec /usr/bin/python3 -c "import sys, time; {}; exec(sys.argv.pop(1))" "$2" "$3"'
    old = fake.format("sys.version_info = (3, 9, 2)")
    late = fake.format("now = time.time; time.time = lambda: now() + 3600")
    for machine, name, text in ((ada, "old-python", old), (bob, "late-python", late)):
        write(machine, f"/usr/local/bin/{name}", f"#!/bin/sh\n{text}\n")
    eve.run("mkdir", "/opt/crcolony")
    eve.run("mount", "-t", "tmpfs", "-o", "size=20m", "tmpfs", "/opt/crcolony")
    hosts = made.hosts | {
        "ada": made.hosts["ada"] | {"crcolony_python": "/usr/local/bin/old-python"},
        "bob": made.hosts["bob"] | {"crcolony_python": "/usr/local/bin/late-python"},
        "ghost": {"ansible_host": "10.0.0.99"},
    }
    made.write(hosts)
    played = made.play("site")
    assert played.code != 0
    for what in (
        "is Python 3.9; crcolony needs 3.11",
        "the clock is 36",
        "/opt/crcolony: 20 MB free",
        "ghost",
    ):
        assert what in played.output
    assert played.hosts["ghost"].is_unreachable
    assert all(played.hosts[name].has_failed for name in ROBOTS)
    assert not played.hosts["field"].has_failed
    assert is_active(made.lan.by_name("field"), "crcolony-arena@pond")
    eve.run("umount", "/opt/crcolony")
    eve.run("rmdir", "/opt/crcolony")
    assert all(is_untouched(made.lan.by_name(name)) for name in ROBOTS)
    show.say("an old Python, a clock an hour off, a full disk, a host that is off: told, untouched")

    namespaces.run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", f"{made.folder}/other")
    made.write()
    other = f"ansible_ssh_private_key_file={made.folder}/other"
    played = made.play("site", "--limit", "eve", "-e", other)
    assert played.hosts["eve"].is_unreachable
    assert "Permission denied" in played.output
    assert is_untouched(eve)
    show.say("a wrong ssh key: told, untouched; the arena's host is set up meanwhile")


def the_playbook_makes_a_colony(made: Deployment, show: Show) -> None:
    """Robots of three hosts live in the arena of a fourth, mate with each other, and have offspring and generations."""
    played = made.play("site")
    assert played.code == 0, played.output
    assert played.hosts["field"].changed == 0
    show.say("site.yml has set up all four")
    ids = {made.id_of(name) for name in ROBOTS}
    assert set(made.robots()) == ids
    made.wait_for_matings(ids, 2)
    wait_until(
        lambda: any(robot["generation"] > 0 for robot in made.robots().values()),
        "a generation is over",
    )
    robots = made.robots().values()
    show.say(
        f"a colony lives: {sum(robot['matings'] for robot in robots) // 2} matings across hosts,"
        f" {sum(robot['conceptions'] for robot in robots)} offspring,"
        f" generation {max(robot['generation'] for robot in robots)}"
    )


def the_second_run_changes_nothing(made: Deployment, show: Show) -> None:
    """Nothing is restarted either."""
    before = {name: main_pid(made.lan.by_name(name), name) for name in ROBOTS}
    played = made.play("site")
    assert played.code == 0, played.output
    assert {name: host.changed for name, host in played.hosts.items()} == dict.fromkeys(NAMES, 0)
    assert {name: main_pid(made.lan.by_name(name), name) for name in ROBOTS} == before
    show.say("site.yml again: changed=0")


def nothing_secret_is_readable(made: Deployment, show: Show) -> None:
    """Keys are their user's alone and in no log; ports are those of the plan; the doctor finds no problem."""
    for name in ROBOTS:
        machine = made.lan.by_name(name)
        key = f"/var/lib/crcolony/robot-{name}/key"
        assert machine.run("stat", "-c", "%U %a", key).split() == ["crcolony", "600"]
        secret = machine.run("cat", key).strip()
        assert secret not in machine.run("journalctl", "--no-pager", "-o", "cat")
        listening = machine.run("ss", "-Hltn").splitlines()
        addresses = {line.split()[3] for line in listening}
        assert addresses == {f"{machine.host.address}:22", f"{machine.host.address}:7447"}
        doctor = machine.run("/opt/crcolony/current/bin/python", "-m", "crcolony", "doctor")
        assert "PROBLEM" not in doctor, doctor
    show.say("keys are 0600 and in no log; only the planned ports listen; doctor: no problem")


def a_guest_enrolls_and_is_revoked(made: Deployment, show: Show) -> None:
    """With a PIN it mates a moment later; a stranger sees nothing; revoked, it mates with nobody after a second."""
    stranger = CertifiedColony(made.folder / "elsewhere", "reef").member("observer", "stranger")
    seen = made.on_laptop("status", "--connect", SEED, "--credentials", str(stranger))
    assert "0 robots alive" in seen.run()
    guest = enrolled_guest(made)
    guest.wait_for("mated with", within_s=60.0)
    show.say("a stranger sees nothing; a guest enrolled with a PIN and mates")
    operator = made.certified.member("operator", "me")
    authority = str(made.certified.authority.folder)
    published = made.on_laptop(
        "authority", "revoke", authority, "guest",
        "--connect", SEED, "--credentials", str(operator),
    ).run()  # fmt: skip
    revoked_s = time.monotonic()
    matings = guest.output.count("mated with")
    robot = guest.output.partition("robot ")[2].split()[0]
    assert " processes that are online have it" in published
    wait_until(lambda: robot not in made.robots(), "the guest is gone", 20.0)
    gone_s = time.monotonic() - revoked_s
    made.wait_for_matings({made.id_of(name) for name in ROBOTS}, 1)
    assert guest.output.count("mated with") == matings
    guest.kill()
    show.say(f"the guest is revoked: no mating any more, gone for all after {gone_s:.1f} s")


def enrolled_guest(made: Deployment) -> Process:
    """Enroll a robot of the laptop with an invitation, and start it."""
    authority, address = str(made.certified.authority.folder), f"{made.lan.laptop.address}:7448"
    service = made.on_laptop("authority", "serve", authority, "--at", address)
    service.start().wait_for("authority of colony reef")
    try:
        invited = made.on_laptop("authority", "invite", authority, "robot", "guest").run()
        invitation = invited.partition("--invitation ")[2].split()[0]
        folder, credentials = made.folder / "guest", str(made.folder / "guest-credentials")
        made.on_laptop("keygen", str(folder / "key")).run()
        made.on_laptop(
            "enroll", "robot", "guest", "--key", str(folder / "key"), "--out", credentials,
            "--at", address, "--invitation", invitation,
        ).run()  # fmt: skip
    finally:
        service.kill()
    return made.on_laptop(
        "robot", *settings(), "--colony", "reef", "--arena", "pond", "--out", str(folder),
        "--connect", SEED, "--credentials", credentials,
    ).start()  # fmt: skip


def a_hung_robot_is_restarted(machine: Machine, show: Show) -> None:
    """SIGSTOP: its loop turns no more, and the watchdog of systemd, here of 3 s, ends it and starts it again."""
    unit = f"crcolony-robot@{machine.name}"
    fast = f"/run/systemd/system/{unit}.service.d/fast.conf"
    write(machine, fast, "[Service]\nWatchdogSec=3\n")
    machine.run("systemctl", "daemon-reload")
    machine.run("systemctl", "restart", unit)
    hung = main_pid(machine, machine.name)
    machine.run("kill", "-STOP", hung)
    wait_until(
        lambda: is_active(machine, unit) and main_pid(machine, machine.name) not in ("0", hung),
        "a hung robot is restarted",
        30.0,
    )
    assert machine.run("systemctl", "show", unit, "-p", "NRestarts", "--value").strip() == "1"
    machine.run("rm", fast)
    machine.run("systemctl", "daemon-reload")
    machine.run("systemctl", "restart", unit)
    show.say("a robot that hung (SIGSTOP) was restarted by the watchdog")


def a_host_is_cut_off_and_comes_back(made: Deployment, show: Show) -> None:
    """Its cable is pulled: the others mate on. Plugged in again: it lives and mates with them."""
    ada, others = made.id_of("ada"), {made.id_of("bob"), made.id_of("eve")}
    host = made.lan.by_name("ada").host
    host.cut()
    wait_until(lambda: ada not in made.robots(), "ada is offline")
    made.wait_for_matings(others, 1)
    host.mend()
    wait_until(lambda: ada in made.robots(), "ada is back")
    made.wait_for_matings({ada}, 1)
    show.say("ada was cut off: the others mated on; it is back and mates")


def a_host_is_rebooted(made: Deployment, show: Show) -> None:
    """All its processes are killed and its systemd starts anew: its robot goes on with its memory."""
    machine, bob = made.lan.by_name("bob"), made.id_of("bob")
    before = made.robots()[bob]
    machine.reboot()
    wait_until(
        lambda: made.robots().get(bob, before)["incarnation"] > before["incarnation"], "bob is back"
    )
    after = made.robots()[bob]
    assert after["matings"] >= before["matings"]
    assert after["conceptions"] >= before["conceptions"]
    show.say(f"bob was rebooted: it resumed with {after['matings']} matings")


def a_host_is_replaced(made: Deployment, show: Show) -> None:
    """An empty host gets the memory, and the identity, of the one that is gone."""
    machine, eve = made.lan.by_name("eve"), made.id_of("eve")
    backup = made.folder / "backup"
    played = made.play("backup", "--limit", "eve", "-e", f"crcolony_backup={backup}")
    assert played.code == 0, played.output
    assert backup.stat().st_mode & 0o077 == 0
    matings = made.matings_of(eve)
    machine.cut_power()
    machine.wipe()
    machine.switch_on()
    machine.wait_until_up()
    assert is_untouched(machine)
    played = made.play("site", "--limit", "eve", "-e", f"crcolony_restore={backup}")
    assert played.code == 0, played.output
    assert made.id_of("eve") == eve
    restored = made.matings_of(eve)
    assert restored >= matings > 0
    made.wait_for_matings({eve}, 1)
    show.say(f"eve's host was replaced by an empty one: the same robot, with {restored} matings")


def a_broken_version_is_rolled_back(
    made: Deployment, show: Show, version: str, broken: str
) -> None:
    """Its robots fail at their start: the first host gets its former version back, the next one is not touched."""
    ada, bob = made.lan.by_name("ada"), made.lan.by_name("bob")
    robot, matings = made.id_of("ada"), made.matings_of(made.id_of("ada"))
    assert broken.startswith("0.99.1+")
    made.wheelhouse = "wheelhouse-broken"
    made.write()
    untouched = main_pid(bob, "bob"), bob.run("ls", "/opt/crcolony/versions")
    played = made.play("upgrade", "--limit", "ada,bob", "-e", "crcolony_health_s=5")
    assert played.code != 0
    assert f"ada did not come back healthy with {broken}: it runs {version} again" in played.output
    assert ada.run("readlink", "/opt/crcolony/current").strip() == f"versions/{version}"
    assert (main_pid(bob, "bob"), bob.run("ls", "/opt/crcolony/versions")) == untouched
    assert made.id_of("ada") == robot
    assert made.matings_of(robot) >= matings
    show.say(f"{broken} is broken: ada runs {version} again, bob was not touched")


def a_good_version_is_rolled_out(made: Deployment, show: Show, good: str) -> None:
    """Host by host; robots keep their identities and memories."""
    robots = made.robots()
    before = {made.id_of(name): robots[made.id_of(name)] for name in ("ada", "bob")}
    made.wheelhouse = "wheelhouse-good"
    made.write()
    played = made.play("upgrade", "--limit", "ada,bob")
    assert played.code == 0, played.output
    for name in ("ada", "bob"):
        current = made.lan.by_name(name).run("readlink", "/opt/crcolony/current").strip()
        assert current == f"versions/{good}"
    wait_until(lambda: set(before) <= set(made.robots()), "both robots are back")
    after = made.robots()
    assert all(after[robot]["matings"] >= was["matings"] for robot, was in before.items())
    made.wait_for_matings(set(before), 1)
    show.say(f"{good} was rolled out, host by host; all memories are there, and they mate on")


def uninstalling_leaves_nothing(made: Deployment, show: Show) -> None:
    """No unit, no user, no folder; what robots have learnt is on the laptop by then."""
    memories = made.folder / "memories"
    played = made.play("uninstall", "-e", f"crcolony_backup={memories}")
    assert played.code == 0, played.output
    assert all(map(is_untouched, made.lan.machines))
    assert {path.name for path in memories.iterdir()} == {f"{name}.tgz" for name in NAMES}
    assert made.play("uninstall", "-e", f"crcolony_backup={memories}").code == 0
    show.say("uninstalled: nothing is left, and the memories are on the laptop")


def write(machine: Machine, path: str, text: str) -> None:
    """Write a file of a machine that anybody may run."""
    script = 'mkdir -p "$(dirname "$1")"; printf %s "$2" >"$1"; chmod 755 "$1"'
    machine.run("sh", "-c", script, "sh", path, text)


def is_active(machine: Machine, unit: str) -> bool:
    """Return whether a unit of a machine is active."""
    return machine.run("systemctl", "is-active", unit, check=False).strip() == "active"


def main_pid(machine: Machine, robot: str) -> str:
    """Return the pid of a robot's process, on its machine."""
    unit = f"crcolony-robot@{robot}"
    return machine.run("systemctl", "show", unit, "-p", "MainPID", "--value").strip()
