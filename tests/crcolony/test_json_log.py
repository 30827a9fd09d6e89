"""The output of a long-running command is lines for people, or JSON objects and nothing else, whatever is printed."""

import io
import json
import sys
import threading
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from crcolony.cli import LOGGING, main
from crcolony.json_log import LOG_FORMAT, JsonLines, JsonLog, json_output, message_of
from crcolony.runtime.console import name_process, print_line, print_warning
from crcolony.transport.zenoh_session import free_port
from tests.support.command_line import parsers_of_commands
from tests.support.process_colony import colony


def records(text: str) -> list[dict[str, Any]]:
    """Return every line as the object that it must be."""
    return [json.loads(line) for line in text.splitlines()]


def test_whatever_is_printed_is_a_record(capsys: pytest.CaptureFixture[str]) -> None:
    """Several lines at once, one in parts, an empty one, line ends and quotes inside, on either stream."""
    with json_output("arena"):
        print("one\ntwo\n")
        print("in ", end="")
        print("parts")
        print_line('"quoted" ‣ Ω\t\udcff')
        print("crcolony: wrong", file=sys.stderr)
        print("without an end", end="")
    printed = capsys.readouterr()
    messages = [record["message"] for record in records(printed.out)]
    assert messages == ["one", "two", "in parts", '"quoted" ‣ Ω\t\udcff', "without an end"]
    (error,) = records(printed.err)
    assert (error["level"], error["message"], error["process"]) == ("error", "wrong", "arena")


def test_a_record_has_its_time_its_level_and_who_it_is_from(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The time is RFC 3339 in UTC; a robot is named from the moment that it knows its id."""
    with json_output("robot"):
        print_line("before")
        name_process(robot="ab12", arena="lab")
        print_warning("after")
    before, after = records(capsys.readouterr().out)
    assert list(before) == ["time", "level", "process", "message"]
    assert datetime.fromisoformat(before["time"]).tzname() == "UTC"
    assert (after["level"], after["robot"], after["arena"]) == ("warning", "ab12", "lab")


def test_the_time_is_that_of_the_clock() -> None:
    """To the millisecond."""
    record = json.loads(JsonLog("arena", lambda: 1_790_000_000.0625).format("x", "info"))
    assert record["time"] == "2026-09-21T14:13:20.062Z"


def test_lines_of_threads_are_not_mixed() -> None:
    """Each line is written whole, though print writes a line and its end one after the other."""
    target = io.StringIO()
    lines = JsonLines(target, JsonLog("host"), "info")

    def write(name: str) -> None:
        for _ in range(500):
            print(name, "x" * 50, file=lines)

    threads = [threading.Thread(target=write, args=(name,)) for name in "abcd"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    messages = {record["message"] for record in records(target.getvalue())}
    assert messages == {f"{name} {'x' * 50}" for name in "abcd"}


def test_a_bug_is_a_record_with_its_traceback(capsys: pytest.CaptureFixture[str]) -> None:
    """And the exit code that Python gives it."""
    with pytest.raises(SystemExit) as ended, json_output("robot"):
        raise ZeroDivisionError("a bug")
    assert ended.value.code == 1
    (record,) = records(capsys.readouterr().err)
    assert (record["level"], record["message"]) == ("critical", "ZeroDivisionError: a bug")
    assert record["traceback"].startswith("Traceback")


def test_a_wrong_option_is_a_record_too(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the option or the environment asks for JSON."""
    assert main(["robot", "--log-format", "json", "--bogus"]) == 2
    (record,) = records(capsys.readouterr().err)
    assert "arguments are required: --out" in record["message"]
    monkeypatch.setenv(LOG_FORMAT, "json")
    assert main(["router", "--client"]) == 2
    (record,) = records(capsys.readouterr().err)
    assert record["message"] == "--client cannot be used with a router"


def test_the_option_is_stronger_than_the_environment(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A person who starts a robot by hand on such a machine can read its lines."""
    monkeypatch.setenv(LOG_FORMAT, "json")
    assert main(["router", "--log-format=lines", "--client"]) == 2
    assert capsys.readouterr().err == "crcolony: --client cannot be used with a router\n"


def test_an_unknown_format_is_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the environment as in the option."""
    monkeypatch.setenv(LOG_FORMAT, "xml")
    assert main(["router"]) == 2
    assert capsys.readouterr().err == f"crcolony: {LOG_FORMAT}=xml: must be lines or json\n"
    assert main(["router", "--log-format", "xml"]) == 2
    assert "invalid choice: 'xml'" in capsys.readouterr().err


def test_short_commands_print_for_people_whatever_the_environment_says(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their output is what they were asked for, such as a table or JSON of their own."""
    monkeypatch.setenv(LOG_FORMAT, "json")
    assert main(["check", "missing.toml"]) == 2
    assert capsys.readouterr().err.startswith("crcolony: missing.toml")


def test_every_long_running_command_has_the_option() -> None:
    """And no other."""
    parsers = parsers_of_commands().items()
    have_it = {name for name, p in parsers if "--log-format" in p._option_string_actions}
    assert have_it == set(LOGGING)


def test_a_message_is_read_from_either_format() -> None:
    """As a launch does with the logs of its processes."""
    record = JsonLog("robot").format("no room", "error")
    assert [message_of(line) for line in (record, "crcolony: no room", "{no", "{}")] == [
        "no room", "no room", "{no", "{}",
    ]  # fmt: skip


def test_real_processes_print_nothing_but_records(tmp_path: Path) -> None:
    """A robot and its arena, from start to end, in a colony where they mate; and one that is refused."""
    with colony(tmp_path) as made:
        arena = made.arena(2, "--log-format", "json")
        one, two = made.robot("--log-format", "json"), made.robot()
        one.wait_for("mated with ")
        two.stop()
        one.stop()
        arena.stop()
        lines = records(one.output)
        mated = next(record for record in lines if record["message"].startswith("mated with "))
        assert (mated["process"], mated["colony"], mated["arena"]) == ("robot", "colony", "arena")
        assert any(
            record["message"] == f"robot {mated['robot']} of colony colony" for record in lines
        )
        assert all(record["process"] == "arena" for record in records(arena.output))
        refused = made.start("refused", "arena", "--log-format", "json", "--robots", "0")
        assert refused.wait() == 2
        (error,) = records(refused.output)
        assert error["level"] == "error"


def test_what_a_launch_starts_prints_as_it_does_itself(tmp_path: Path) -> None:
    """Its own output and the logs of its processes are JSON, and why one cannot run is still understood."""
    with colony(tmp_path) as made:
        out, listen = tmp_path / "run", f"tcp/127.0.0.1:{free_port()}"
        words = ("-n", "1", "--no-plots", "--out", str(out), "--listen", listen)
        launch = made.start("launch", "launch", *words, "--hz", "10", "--log-format", "json")
        launch.wait_for("generation 0")
        launch.stop()
        assert {record["process"] for record in records(launch.output)} == {"launch"}
        logs = {path.stem: records(path.read_text()) for path in (out / "logs").iterdir()}
        assert {lines[0]["process"] for lines in logs.values()} == {"arena", "robot"}
