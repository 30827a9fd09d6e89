"""An arena that runs twice under one name, and a key in two processes, are problems."""

from pathlib import Path

from crcolony_deploy.doctor.arenas import check_arenas
from crcolony_deploy.doctor.colony_view import ColonyView

from tests.support.examined_hosts import ADA, arena_online, host_of, lines, online


def test_an_arena_is_to_run_once(tmp_path: Path) -> None:
    """Of two with one name each would take the other's robots."""
    view = ColonyView(arenas=(arena_online("pond", 1), arena_online("lake", 2)))
    assert lines(check_arenas(host_of(tmp_path, colony=view))) == [
        "ok: arena pond is online once",
        "problem: 2 arenas of the name lake are online",
    ]


def test_a_key_in_two_processes_is_a_problem(tmp_path: Path) -> None:
    """A folder was copied."""
    view = ColonyView((online(ADA, "pond", sessions=2),))
    assert lines(check_arenas(host_of(tmp_path, colony=view))) == [
        f"problem: robot {ADA.hex()[:8]} is online in two processes"
    ]
