"""A re-simulated run has the telemetry it would have had: the same events in the same order, by robots with ids."""

import json
import shutil
from collections import Counter
from pathlib import Path

import pytest

from crcolony.config import Config
from crcolony.evolution.history import Event, HistoryHash, Lived
from crcolony.in_process.run import start_run
from crcolony.protocol.identity import seeded
from crcolony.protocol.telemetry_messages import Exchanged, RobotState
from crcolony.recordings.past_run import PastRunError, read_history, read_run
from crcolony.recordings.resimulation import HistoryDiffersError, Windows, from_history, resimulate
from crcolony.recordings.sources import samples_of
from crcolony.results.earlier_run import read_earlier_run
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.samples import SceneSample, StateSample, TelemetrySample
from tests.support.run_folders import finish, run
from tests.support.runs import SEED, event_messages, history_of
from tests.support.small_colony import Recorder, live, new_colony, small

TICKS_OF_A_GENERATION = 4 * 2 * 150


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


def test_the_events_are_the_history_of_the_run(
    folder: Path, samples: list[TelemetrySample]
) -> None:
    """Event by event, with numbers for ids again, and so their hash is that of the run."""
    past = read_run(folder)
    events = history_of(samples, past.robots)
    assert events == recorded(f"seed={SEED}").events
    assert hash_of(events) == past.history_hash
    assert list(read_history(past.history)) == events


def test_a_run_that_began_with_robots_of_another_begins_with_them_again(
    folder: Path, tmp_path: Path
) -> None:
    """From its own folder alone; its robots are other ones than those of a run from random genotypes."""
    config = small("generations=1")
    earlier = tmp_path / "earlier"
    shutil.copytree(folder, earlier)
    finish(*start_run(tmp_path / "run", config, read_earlier_run(earlier).beginning(config)))
    shutil.rmtree(earlier)
    past = read_run(tmp_path / "run")
    assert history_of(list(resimulate(past)), past.robots) == list(read_history(past.history))
    assert seeded("colony", config.seed, 0).id not in past.robots


def test_robots_have_the_ids_of_a_lockstep_colony(
    folder: Path, samples: list[TelemetrySample]
) -> None:
    """They follow from colony, seed and number; the names of agents begin with them."""
    robots = [seeded("colony", SEED, number).id for number in range(4)]
    assert list(read_run(folder).robots) == robots
    messages = event_messages(samples)
    assert Counter(message.robot for message in messages).keys() == set(robots)
    lived = [message for message in messages if isinstance(message.event, Lived)]
    assert lived
    assert all(m.event.agent.startswith(f"{m.robot.hex()}/") for m in lived)  # type: ignore[union-attr]


def test_a_monitor_accepts_all_samples(folder: Path, samples: list[TelemetrySample]) -> None:
    """No sample is malformed, stale or ignored, no event is missed, and every event is reported once."""
    monitor = ColonyMonitor()
    changes = [change for sample in samples for change in monitor.handle_sample(sample)]
    assert (monitor.malformed, monitor.stale, monitor.ignored) == (0, 0, 0)
    assert [status.missed for status in monitor.alive] == [0] * 4
    assert len(changes) == 5 + monitor.samples["event"]
    assert all(status.metadata and len(status.metadata.peers) == 3 for status in monitor.alive)
    assert monitor.arenas["arena"].metadata is not None


def test_there_are_scenes_in_windows_only(folder: Path) -> None:
    """In every tick of the wanted starts of generations, with states twice a second, and in no other tick."""
    samples = list(resimulate(read_run(folder), Windows(frozenset({1}), 10.0)))
    scenes = [sample.scene for sample in samples if isinstance(sample, SceneSample)]
    start = TICKS_OF_A_GENERATION
    assert [scene.tick for scene in scenes] == list(range(start + 1, start + 51))
    assert [scene.seq for scene in scenes] == list(range(1, 51))
    assert all(len(scene.robots) == 4 and len(scene.packs) == 8 for scene in scenes)
    states = [sample.state for sample in samples if isinstance(sample, StateSample)]
    ticks = sorted({state.tick for state in states})
    assert sum(start < tick <= start + 50 for tick in ticks) == 25
    assert len(ticks) < 25 + 3 * (1 + TICKS_OF_A_GENERATION // 300) + 2


def test_the_windows_are_the_first_and_the_last_generation_by_default(
    samples: list[TelemetrySample],
) -> None:
    """Two minutes of each."""
    ticks = [sample.scene.tick for sample in samples if isinstance(sample, SceneSample)]
    last = 2 * TICKS_OF_A_GENERATION
    assert ticks == [*range(1, 601), *range(last + 1, last + 601)]


def test_states_agree_with_the_events(samples: list[TelemetrySample]) -> None:
    """Matings, conceptions and captures of the last state are those of all events."""
    last: dict[bytes, RobotState] = {}
    for sample in samples:
        if isinstance(sample, StateSample):
            last[sample.state.robot] = sample.state
    messages = event_messages(samples)
    assert all(state.matings > 0 for state in last.values())
    assert sum(state.captures for state in last.values()) > 0
    for robot, state in last.items():
        own = [message.event for message in messages if message.robot == robot]
        exchanged = [event for event in own if isinstance(event, Exchanged)]
        lifetimes = [event for event in own if isinstance(event, Lived)]
        assert state.generation == 3
        assert state.seq == len(own)
        assert state.matings == len(exchanged)
        assert state.conceptions == sum(event.conceived for event in exchanged)
        assert state.captures == sum(lifetime.captures for lifetime in lifetimes)


def test_time_passes_evenly_from_the_start_of_the_run(
    folder: Path, samples: list[TelemetrySample]
) -> None:
    """Every sample arrives at its tick, in order."""
    start_ms = read_run(folder).start_unix_ms
    times = [sample.unix_ms for sample in samples]
    assert times == sorted(times)
    for sample in samples:
        if isinstance(sample, SceneSample):
            scene = sample.scene
            assert sample.unix_ms == scene.unix_ms == start_ms + 200 * scene.tick


def test_the_same_run_has_the_same_samples(folder: Path, samples: list[TelemetrySample]) -> None:
    """However often it is re-simulated."""
    assert list(resimulate(read_run(folder))) == samples


@pytest.mark.parametrize("config", [small("selection=central"), small("robots=3", "seed=5")])
def test_runs_of_other_settings_can_be_resimulated(tmp_path: Path, config: Config) -> None:
    """The central baseline, too: its parents are of any robot."""
    run(tmp_path / "run", config)
    past = read_run(tmp_path / "run")
    events = history_of(resimulate(past), past.robots)
    assert hash_of(events) == past.history_hash


def test_a_run_that_was_stopped_is_resimulated_until_it_was(tmp_path: Path) -> None:
    """In the middle of a generation."""
    run(tmp_path / "run", small("life.agents=40"), stop_after=1)
    past = read_run(tmp_path / "run")
    assert past.generations == 0
    events = history_of(resimulate(past), past.robots)
    assert hash_of(events) == past.history_hash
    assert len(events) > 4 * 40


def test_a_history_that_differs_is_an_error_at_the_end(tmp_path: Path, folder: Path) -> None:
    """As that of a run by another version of the code would."""
    copy = tmp_path / "other"
    shutil.copytree(folder, copy)
    description = json.loads((copy / "run.json").read_text())
    (copy / "run.json").write_text(json.dumps({**description, "history_hash": "00" * 16}))
    samples = resimulate(read_run(copy))
    with pytest.raises(HistoryDiffersError, match=f"{copy}: re-simulated, it has another history"):
        for _ in samples:
            pass


class TestHistory:
    """A run that cannot be re-simulated has the telemetry that follows from its history."""

    @pytest.fixture
    def launched(self, tmp_path: Path, folder: Path) -> Path:
        """A folder as a launch in real time leaves it."""
        return self.launch(tmp_path, folder, "robots of their own")

    @staticmethod
    def launch(tmp_path: Path, folder: Path, colony: str) -> Path:
        copy = tmp_path / "launched"
        shutil.copytree(folder, copy)
        description = json.loads((copy / "run.json").read_text())
        robots = [seeded(colony, SEED, number).id.hex() for number in range(4)]
        keys = ("status", "generations", "history_hash")
        (copy / "run.json").write_text(
            json.dumps({**{key: description[key] for key in keys}, "robots": robots})
        )
        return copy

    def test_it_has_all_events_by_its_own_robots(self, launched: Path) -> None:
        """And a state at every turnover, but no scenes."""
        past = read_run(launched)
        samples = list(samples_of(launched))
        assert hash_of(history_of(samples, past.robots)) == past.history_hash
        counts = Counter(sample.kind for sample in samples)
        assert (counts["online"], counts["metadata"], counts["scene"]) == (5, 5, 0)
        states = [sample.state for sample in samples if isinstance(sample, StateSample)]
        assert [state.generation for state in states] == [g for g in range(4) for _ in range(4)]
        monitor = ColonyMonitor()
        for sample in samples:
            monitor.handle_sample(sample)
        assert (monitor.malformed, monitor.stale) == (0, 0)
        assert [status.missed for status in monitor.alive] == [0] * 4

    def test_it_is_not_resimulated(self, launched: Path) -> None:
        """Its robots are not those of its config."""
        with pytest.raises(PastRunError, match="cannot be re-simulated"):
            resimulate(read_run(launched))

    def test_a_lockstep_colony_is_resimulated(self, tmp_path: Path, folder: Path) -> None:
        """Its robots are those of its config, so it has the history of an in-process one."""
        launched = self.launch(tmp_path, folder, "colony")
        assert "scene" in {sample.kind for sample in samples_of(launched)}

    def test_events_of_robots_without_ids_are_left_out(self, launched: Path) -> None:
        """As of a robot whose files are elsewhere."""
        description = json.loads((launched / "run.json").read_text())
        robots = description["robots"][:2]
        (launched / "run.json").write_text(json.dumps({**description, "robots": robots}))
        past = read_run(launched)
        assert {m.robot for m in event_messages(from_history(past))} == set(past.robots)
