"""A process that starts before its network waits for it; what it waits for, and what cannot be reached, is said."""

import fcntl
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from crcolony.config import Config
from crcolony.robot.aot_step import machine_code_path
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.transport.zenoh_session import free_port
from tests.support.command_line import run_command
from tests.support.namespaces import Host, hosts, needs_namespaces, run
from tests.support.process_colony import Colony, colony, settings

CLOCK = ("--hz", "30")
NOBODY = "no robot, arena or router answers at"


@pytest.fixture
def made(tmp_path: Path) -> Iterator[Colony]:
    with colony(tmp_path) as made:
        yield made


@pytest.mark.parametrize(
    "command",
    [
        ("robot", "--out", "OUT"),
        ("arena", "--listen", "OTHER"),
        ("host", "-n", "1", "--listen", "OTHER", "--out", "OUT"),
        ("launch", "-n", "1", "--robots-only", "--out", "OUT"),
        ("top",),
        ("dashboard", "--no-recording", "--port", "PORT"),
    ],
    ids=lambda words: words[0],
)
def test_every_command_says_where_nobody_answers(
    made: Colony, tmp_path: Path, command: tuple[str, ...]
) -> None:
    """With the reason; and once more when somebody does, without having ended meanwhile."""
    ports = {"OTHER": f"tcp/127.0.0.1:{free_port()}", "OUT": str(tmp_path / "out")}
    ports["PORT"] = str(free_port())
    words = [ports.get(word, word) for word in command]
    process = made.start("tried", *words, "--connect", made.endpoint)
    process.wait_for(f"{NOBODY} {made.endpoint} (connection refused); retrying")
    router = made.start("router", "router", "--listen", made.endpoint)
    router.wait_for("router at")
    process.wait_for(f"{made.endpoint} answers")
    assert process.output.count(NOBODY) == 1


def test_status_ends_with_a_word_where_nobody_answers(made: Colony) -> None:
    """Instead of an empty table; with exit code 2."""
    for words in (("status",), ("status", "--json"), ("status", "--client")):
        done = run_command(*words, "--connect", made.endpoint)
        assert done.returncode == 2
        assert not done.stdout
        assert f"answers at {made.endpoint} (connection refused)" in done.stderr
    router = made.start("router", "router", "--listen", made.endpoint)
    router.wait_for("router at")
    done = run_command("status", "--connect", made.endpoint)
    assert done.returncode == 0
    assert "waiting for robots and an arena to come online" in done.stdout


def test_clients_wait_for_a_router_that_starts_later(made: Colony) -> None:
    """An arena, a robot and `top`: each says so once, and goes on when the router is there."""
    network = ("--client", "--connect", made.endpoint)
    top = made.start("top", "top", *network)
    processes = [made.arena(1, *CLOCK, *network), made.robot(*network), top]
    for process in processes:
        process.wait_for(f"waiting for the network: no router answers at {made.endpoint}")
    made.start("router", "router", "--listen", made.endpoint)
    made.robots[0].wait_for("has body")
    top.wait_for("1 robots alive")
    for process in processes:
        assert process.output.count("waiting for the network") == 1
        assert process.output.count("the network is there") == 1


def set_address(host: Host) -> None:
    """Give a host its address again, after `flush`."""
    run("ip", "-n", host.name, "address", "add", f"{host.address}/24", "dev", "eth0")


def flush(host: Host) -> None:
    """Take a host's address, and with it its routes."""
    run("ip", "-n", host.name, "address", "flush", "dev", "eth0")


@needs_namespaces
def test_processes_that_boot_before_their_interface_wait_for_it(made: Colony) -> None:
    """An arena whose address to listen on is not there yet, and a robot without a way to its seed."""
    with hosts(2) as lan:
        made.endpoint = f"tcp/{lan[0].address}:7447"
        for host in lan:
            flush(host)
        arena = made.arena(1, *CLOCK, before=lan[0].before)
        robot = made.robot(before=lan[1].before)
        arena.wait_for(
            f"waiting for the network: {made.endpoint}: this machine has no such address"
        )
        robot.wait_for(f"waiting for the network: {made.endpoint}: network unreachable")
        for host in lan:
            set_address(host)
        robot.wait_for("has body")
        assert robot.output.count("waiting for the network") == 1
        made.stop_robots()
        arena.stop()


@needs_namespaces
def test_an_interface_that_comes_up_later_is_waited_for(made: Colony) -> None:
    """Of robots that find each other by multicast."""
    with hosts(2) as lan:
        by_multicast = ("--interface", "eth0")
        run("ip", "-n", lan[1].name, "link", "set", "eth0", "down")
        made.arena(1, *CLOCK, *by_multicast, before=lan[0].before)
        robot = made.robot(*by_multicast, before=lan[1].before)
        robot.wait_for("waiting for the network: interface eth0: it is down")
        run("ip", "-n", lan[1].name, "link", "set", "eth0", "up")
        run("ip", "-n", lan[1].name, "route", "replace", "224.0.0.0/4", "dev", "eth0")
        robot.wait_for("has body")


@pytest.fixture
def later_names() -> Iterator[Path]:
    """The folder of /etc of the first host's namespace, whose files replace those of /etc there."""
    with hosts(1) as lan:
        folder = Path("/etc/netns") / lan[0].name
        folder.mkdir(parents=True)
        try:
            yield folder
        finally:
            shutil.rmtree(folder)


@needs_namespaces
def test_a_name_that_is_known_later_is_waited_for(made: Colony, later_names: Path) -> None:
    """A robot's seed by name: its DNS starts after it."""
    before = ("ip", "netns", "exec", later_names.name)
    names = later_names / "hosts"
    names.write_text("127.0.0.1 localhost\n")
    made.arena(1, *CLOCK, "--listen", "tcp/127.0.0.1:7447", before=before)
    robot = made.robot("--connect", "tcp/colony.example:7447", before=before)
    robot.wait_for("waiting for the network: tcp/colony.example:7447: its name ")
    names.write_text("127.0.0.1 localhost colony.example\n")
    robot.wait_for("has body")
    assert robot.output.count("waiting for the network") <= 2  # unknown, or not to be looked up now


@needs_namespaces
def test_robots_that_cannot_be_reached_are_counted(made: Colony) -> None:
    """An observer behind a firewall sees the arena, and only one of its two robots."""
    with hosts(4) as lan:
        made.endpoint = f"tcp/{lan[0].address}:7447"
        lan[3].ignore(lan[1])
        made.arena(2, *CLOCK, before=lan[0].before)
        for host in lan[1:3]:
            made.robot("--listen", f"tcp/{host.address}:7450", before=host.before)
        for robot in made.robots:
            robot.wait_for("has body")
        top = made.start("top", "top", "--connect", made.endpoint, before=lan[3].before)
        top.wait_for("1 of 2 robots in arena arena cannot be reached from here: open their ports")


def test_what_has_changed_in_an_arena_is_said(made: Colony, tmp_path: Path) -> None:
    """A robot, `top` and `launch` name every setting with both values when the arena is restarted with others."""
    words = ("arena", *settings(), "--robots", "2", *CLOCK, "--listen", made.endpoint)
    first = made.start("first", *words)
    robot, top = made.robot(), made.start("top", "top", "--connect", made.endpoint)
    launch = made.start(
        "launch", "launch", "-n", "1", "--robots-only", "--connect", made.endpoint,
        "--out", str(tmp_path / "launch"), *settings(),
    )  # fmt: skip
    for process in (robot, top, launch):
        process.wait_for("has body") if process is robot else process.wait_for("2 robots alive", 3)
    first.stop()
    robot.wait_for("the arena is offline; waiting for arena arena")
    made.start("second", *words, "--set", "arena.packs_per_robot=5")
    for process in (robot, top, launch):
        process.wait_for("arena arena has other settings than before: arena.packs_per_robot")
    robot.wait_for("has body", count=2)


def code_path_with(cache: Path) -> Path:
    """Return where a process with another cache folder looks for the machine code of the step."""
    program = "from tests.system.test_waiting import step_path; print(step_path())"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    path = Path(done.stdout.strip())
    assert path.is_relative_to(cache)
    return path


def step_path() -> Path:
    """Return the file of the compiled step of this process."""
    path = machine_code_path(*make_robots(Config(), ["0"], numbered_streams(0, 0, 1))[:2])
    assert path is not None
    return path


def test_a_robot_that_compiles_is_seen_with_its_progress(
    made: Colony, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By `status` and `top`, though it is not online yet; here another process compiles, and is 40 % done."""
    compiled_step = step_path()
    if not compiled_step.exists():
        pytest.skip("no step is compiled yet: other tests do it")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = code_path_with(tmp_path / "cache")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.with_suffix(".progress").write_text("[10, 25]")
    made.start("router", "router", "--listen", made.endpoint).wait_for("router at")
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        robot = made.robot()
        robot.wait_for("compiling the control step, 40 %")
        top = made.start("top", "top", "--connect", made.endpoint)
        top.wait_for(
            "0 robots alive, 1 starting   no arena online   compiling the control step, 40 %"
        )
        status = run_command("status", "--seconds", "5", "--connect", made.endpoint).stdout
        assert "starting" in status
        assert "compiling the control step, 40 %" in status
        shutil.copy(compiled_step, path)
    robot.wait_for("waiting for arena arena")
    top.wait_for("waiting for arena arena")
    robot.stop()
