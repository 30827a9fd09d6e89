"""A run that is over is heard again as it was: the same events in the same order, by robots that have ids."""

import json
import shutil
from collections import Counter
from pathlib import Path

import pytest

from crcolony.config import Config, ConfigError
from crcolony.evolution.history import Event, HistoryHash, Lived
from crcolony.protocol.identity import seeded
from crcolony.protocol.telemetry_messages import Exchanged, RobotState, decode_scene, decode_state
from crcolony.recordings.past_run import PastRunError, read_history, read_run
from crcolony.recordings.resimulation import HistoryDiffersError, Windows, from_history, resimulate
from crcolony.recordings.sources import metadata_samples_of, samples_of
from crcolony.telemetry.colony_monitor import ColonyMonitor, TelemetrySample
from tests.support.runs import history_in, run, told_in
from tests.support.small_colony import Recorder, live, new_colony, small

SEED = 10
"""Of a colony in which every robot mates"""
TICKS_OF_A_GENERATION = 4 * 2 * 150


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of three generations."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    run(folder, small(f"seed={SEED}"))
    return folder


@pytest.fixture(scope="module")
def sample(folder: Path) -> list[TelemetrySample]:
    """That run, lived again."""
    return list(resimulate(read_run(folder)))


def recorded(*settings: str) -> Recorder:
    colony, recorder = new_colony(*settings)
    colony.start()
    live(colony)
    return recorder


def hash_of(events: list[Event]) -> str:
    chain = HistoryHash()
    for event in events:
        chain.add(event)
    return str(chain)


def test_what_is_told_is_the_history_of_the_run(
    folder: Path, sample: list[TelemetrySample]
) -> None:
    """Event by event, renamed back, and so its hash is that of the run."""
    past = read_run(folder)
    events = history_in(sample, past.robots)
    assert events == recorded(f"seed={SEED}").events
    assert hash_of(events) == past.history_hash
    assert list(read_history(past.history)) == events


def test_robots_are_called_as_those_of_a_lockstep_colony(
    folder: Path, sample: list[TelemetrySample]
) -> None:
    """Their ids follow from colony, seed and number; agents are named by them."""
    robots = [seeded("colony", SEED, number).id for number in range(4)]
    assert list(read_run(folder).robots) == robots
    message = told_in(sample)
    assert Counter(t.robot for t in message).keys() == set(robots)
    lived = [t for t in message if isinstance(t.event, Lived)]
    assert lived
    assert all(t.event.agent.startswith(f"{t.robot.hex()}/") for t in lived)  # type: ignore[union-attr]


def test_a_watcher_takes_all_of_it(folder: Path, sample: list[TelemetrySample]) -> None:
    """Nothing is malformed, late, missed or unknown, and every event is news once."""
    monitor = ColonyMonitor()
    changes = [one for h in sample for one in monitor.handle_sample(h)]
    assert (monitor.malformed, monitor.stale, monitor.ignored) == (0, 0, 0)
    assert [status.missed for status in monitor.alive] == [0] * 4
    assert len(changes) == 5 + monitor.samples["event"]
    assert all(status.metadata and len(status.metadata.peers) == 3 for status in monitor.alive)
    assert monitor.arenas["arena"].metadata is not None


def test_scenes_are_shown_in_windows_only(folder: Path) -> None:
    """Every tick of the beginnings that are asked for, and no other; states are twice a second there."""
    sample = list(resimulate(read_run(folder), Windows(frozenset({1}), 10.0)))
    scenes = [decode_scene(one.data) for one in sample if one.kind == "scene"]
    begun = TICKS_OF_A_GENERATION
    assert [scene.tick for scene in scenes] == list(range(begun + 1, begun + 51))
    assert [scene.seq for scene in scenes] == list(range(1, 51))
    assert all(len(scene.robots) == 4 and len(scene.packs) == 8 for scene in scenes)
    states = [decode_state(one.data) for one in sample if one.kind == "state"]
    ticks = sorted({state.tick for state in states})
    assert sum(begun < tick <= begun + 50 for tick in ticks) == 25
    assert len(ticks) < 25 + 3 * (1 + TICKS_OF_A_GENERATION // 300) + 2


def test_first_and_last_generation_are_shown_without_being_asked_for(
    sample: list[TelemetrySample],
) -> None:
    """Two minutes of each."""
    ticks = [decode_scene(one.data).tick for one in sample if one.kind == "scene"]
    last = 2 * TICKS_OF_A_GENERATION
    assert ticks == [*range(1, 601), *range(last + 1, last + 601)]


def test_states_add_up_to_the_events(sample: list[TelemetrySample]) -> None:
    """Matings, conceptions and captures of the last state are those that were told."""
    last: dict[bytes, RobotState] = {}
    for one in sample:
        if one.kind == "state":
            state = decode_state(one.data)
            last[state.robot] = state
    message = told_in(sample)
    assert all(state.matings > 0 for state in last.values())
    assert sum(state.captures for state in last.values()) > 0
    for robot, state in last.items():
        own = [t.event for t in message if t.robot == robot]
        exchanged = [event for event in own if isinstance(event, Exchanged)]
        lives = [event for event in own if isinstance(event, Lived)]
        assert state.generation == 3
        assert state.seq == len(own)
        assert state.matings == len(exchanged)
        assert state.conceptions == sum(event.conceived for event in exchanged)
        assert state.captures == sum(incarnation.captures for incarnation in lives)


def test_time_goes_on_evenly_from_when_the_run_began(
    folder: Path, sample: list[TelemetrySample]
) -> None:
    """Everything is heard at its tick, in order."""
    start_ms = read_run(folder).start_unix_ms
    times = [one.unix_ms for one in sample]
    assert times == sorted(times)
    for one in sample:
        if one.kind == "scene":
            scene = decode_scene(one.data)
            assert one.unix_ms == scene.unix_ms == start_ms + 200 * scene.tick


def test_the_same_run_is_heard_as_the_same_bytes(
    folder: Path, sample: list[TelemetrySample]
) -> None:
    """However often it is lived again."""
    assert list(resimulate(read_run(folder))) == sample


@pytest.mark.parametrize("config", [small("selection=central"), small("robots=3", "seed=5")])
def test_runs_of_other_settings_can_be_lived_again(tmp_path: Path, config: Config) -> None:
    """The central baseline, too: its parents are of any robot."""
    run(tmp_path / "run", config)
    past = read_run(tmp_path / "run")
    events = history_in(resimulate(past), past.robots)
    assert hash_of(events) == past.history_hash


def test_a_run_that_was_stopped_is_lived_as_far_as_it_went(tmp_path: Path) -> None:
    """In the middle of a generation."""
    run(tmp_path / "run", small("life.agents=40"), stop_after=1)
    past = read_run(tmp_path / "run")
    assert past.generations == 0
    events = history_in(resimulate(past), past.robots)
    assert hash_of(events) == past.history_hash
    assert len(events) > 4 * 40


def test_a_run_that_comes_out_otherwise_is_said_in_the_end(tmp_path: Path, folder: Path) -> None:
    """As one of another version of the code would."""
    copy = tmp_path / "other"
    shutil.copytree(folder, copy)
    message = json.loads((copy / "run.json").read_text())
    (copy / "run.json").write_text(json.dumps({**message, "history_hash": "00" * 16}))
    sample = resimulate(read_run(copy))
    with pytest.raises(HistoryDiffersError, match=f"{copy}: lived again"):
        for _ in sample:
            pass


class TestHistory:
    """What cannot be lived again is told from its history."""

    @pytest.fixture
    def launched(self, tmp_path: Path, folder: Path) -> Path:
        """A folder as a launch in real time leaves it."""
        return self.launch(tmp_path, folder, "robots of their own")

    @staticmethod
    def launch(tmp_path: Path, folder: Path, colony: str) -> Path:
        copy = tmp_path / "launched"
        shutil.copytree(folder, copy)
        message = json.loads((copy / "run.json").read_text())
        robots = [seeded(colony, SEED, number).id.hex() for number in range(4)]
        keys = ("status", "generations", "history_hash")
        (copy / "run.json").write_text(
            json.dumps({**{key: message[key] for key in keys}, "robots": robots})
        )
        return copy

    def test_its_events_are_told_by_its_own_robots(self, launched: Path) -> None:
        """All of them, and a state at every turnover; nobody says where they were."""
        past = read_run(launched)
        sample = list(samples_of(launched))
        assert hash_of(history_in(sample, past.robots)) == past.history_hash
        counts = Counter(one.kind for one in sample)
        assert (counts["alive"], counts["metadata"], counts["scene"]) == (5, 5, 0)
        states = [decode_state(one.data) for one in sample if one.kind == "state"]
        assert [state.generation for state in states] == [g for g in range(4) for _ in range(4)]
        monitor = ColonyMonitor()
        for one in sample:
            monitor.handle_sample(one)
        assert (monitor.malformed, monitor.stale) == (0, 0)
        assert [status.missed for status in monitor.alive] == [0] * 4

    def test_it_is_not_lived_again(self, launched: Path) -> None:
        """Its robots are not those that the config makes."""
        with pytest.raises(PastRunError, match="cannot be lived again"):
            resimulate(read_run(launched))

    def test_a_lockstep_colony_is_lived_again(self, tmp_path: Path, folder: Path) -> None:
        """Its robots are, so that it has the history of an embedded one."""
        launched = self.launch(tmp_path, folder, "colony")
        assert "scene" in {one.kind for one in samples_of(launched)}

    def test_events_of_robots_without_ids_are_left_out(self, launched: Path) -> None:
        """As of one whose memory is elsewhere."""
        message = json.loads((launched / "run.json").read_text())
        (launched / "run.json").write_text(json.dumps({**message, "robots": message["robots"][:2]}))
        past = read_run(launched)
        told_of = {t.robot for t in told_in(from_history(past))}
        assert told_of == set(past.robots)


def test_what_robots_are_like_is_known_without_living(
    folder: Path, sample: list[TelemetrySample]
) -> None:
    """The same answers as in the whole."""
    assert list(metadata_samples_of(folder)) == [one for one in sample if one.kind == "metadata"]


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("config.toml", None, "config.toml is missing"),
        ("config.toml", "robots = 'many'", "robots"),
        ("run.json", None, "run.json: missing"),
        ("run.json", "{}", "run.json: does not tell of a run"),
        ("run.json", "[1]", "run.json: does not tell of a run"),
        ("run.json", "\x00", "run.json: does not tell of a run"),
        ("run.json", '{"generations": 1, "history_hash": "", "robots": ["ab"]}', "run.json"),
        ("history.sqlite", None, "history.sqlite: missing"),
        ("history.sqlite", "nonsense " * 100, "history.sqlite: cannot be read"),
    ],
)
def test_a_folder_that_does_not_tell_is_named(
    tmp_path: Path, folder: Path, name: str, content: str | None, reason: str
) -> None:
    """With the file and the reason, in one line."""
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    (copy / name).unlink()
    if content is not None:
        (copy / name).write_text(content)
    with pytest.raises((PastRunError, ConfigError), match=reason) as refused:
        list(from_history(read_run(copy)))
    assert str(copy) in str(refused.value)
    assert "\n" not in str(refused.value)
