"""Exported tables hold the telemetry: every value in its column, every event once, and all tables or none."""

import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow.parquet as pq  # type: ignore[import-untyped]
import pytest

from crcolony.evolution.genotype import Schema
from crcolony.evolution.history import Born, Died, Lived, TurnedOver
from crcolony.protocol.codec import encode
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.telemetry_messages import (
    EncounterOutcome,
    EventMessage,
    Exchanged,
    Fault,
    Met,
)
from crcolony.recordings.export import ExportError, export
from crcolony.recordings.past_run import PastRunError, read_run
from crcolony.recordings.resimulation import Windows
from crcolony.recordings.telemetry_schema import TelemetryError
from crcolony.robot.genes import agent_schema
from crcolony.telemetry.samples import (
    EventSample,
    RawSample,
    RobotMetadataSample,
    SceneSample,
    StateSample,
    TelemetrySample,
)
from tests.support.raw_samples import raw_sample, record
from tests.support.runs import event_messages
from tests.support.small_colony import small
from tests.vectors.make import EVENT_MESSAGES, EVENTS, INITIATOR

EXAMPLE = Path("examples/foraging_and_mating.py").absolute()
TABLES = {
    "states", "births", "deaths", "lives", "turnovers", "meetings", "matings", "outcomes",
    "faults", "poses", "packs",
}  # fmt: skip


@pytest.fixture(scope="module")
def tables(
    tmp_path_factory: pytest.TempPathFactory, short_samples: list[TelemetrySample]
) -> dict[str, list[dict[str, Any]]]:
    """The tables of a recording of a short run."""
    folder = tmp_path_factory.mktemp("recorded")
    record(folder / "telemetry.sqlite", map(raw_sample, short_samples))
    return read(export(folder, folder / "parquet"))


def read(paths: Sequence[Path]) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of all tables by the names of their files."""
    return {path.stem: pq.read_table(path).to_pylist() for path in paths}


def schema() -> Schema:
    config = small()
    return agent_schema(config.learning, config.heredity)


def test_there_is_a_table_for_everything(tables: dict[str, list[dict[str, Any]]]) -> None:
    """Also where it is empty."""
    assert tables.keys() == TABLES
    assert tables["outcomes"] == tables["faults"] == []


def test_states_are_as_they_were_published(
    short_samples: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]]
) -> None:
    """Field by field, with the id as hex digits, beside colony and time."""
    states = [(s.unix_ms, s.state) for s in short_samples if isinstance(s, StateSample)]
    assert tables["states"] == [
        {
            "received_unix_ms": unix_ms,
            "colony": "colony",
            **msgspec.structs.asdict(state),
            "robot": state.robot.hex(),
        }
        for unix_ms, state in states
    ]


@pytest.mark.parametrize(
    ("name", "kind"),
    [("deaths", Died), ("lives", Lived), ("turnovers", TurnedOver), ("meetings", Met)],
)
def test_events_are_as_they_were_published(
    short_samples: list[TelemetrySample],
    tables: dict[str, list[dict[str, Any]]],
    name: str,
    kind: type,
) -> None:
    """Each once, in order, with its robot."""
    messages = [m for m in event_messages(short_samples) if isinstance(m.event, kind)]
    assert name == "deaths" or messages
    for row, message in zip(tables[name], messages, strict=True):
        fields = msgspec.structs.asdict(message.event)
        if "peer" in fields:
            fields["peer"] = fields["peer"].hex()
        else:
            fields["number"] = fields.pop("robot")
        head = {
            "received_unix_ms": message.unix_ms,
            "colony": "colony",
            "robot": message.robot.hex(),
            "incarnation": message.incarnation,
            "seq": message.seq,
            "unix_ms": message.unix_ms,
        }
        assert row == {**head, **fields}


def test_a_mating_has_a_row_of_each_robot(
    short_samples: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]]
) -> None:
    """With its own energy and decision, and the same encounter."""
    messages = event_messages(short_samples)
    events = [m.event for m in messages if isinstance(m.event, Exchanged)]
    rows = tables["matings"]
    assert len(rows) == len(events) >= 10
    for row, event in zip(rows, events, strict=True):
        encounter = event.encounter
        assert row["initiator"] == encounter.initiator.hex()
        assert row["responder"] == encounter.responder.hex()
        assert (row["encounter_incarnation"], row["encounter_count"]) == encounter.number
        for field in ("tick", "agent", "partner", "energy", "conceived", "too_late"):
            assert row[field] == getattr(event, field)
    names = ("initiator", "encounter_incarnation", "encounter_count")
    assert len({tuple(row[name] for name in names) for row in rows}) == len(rows) // 2


def test_births_have_a_column_for_every_gene(
    short_samples: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]]
) -> None:
    """By its name in the schema, which follows from the robots' settings."""
    names = [gene.name for gene in schema().genes]
    events = [m.event for m in event_messages(short_samples) if isinstance(m.event, Born)]
    assert len(events) == 4 * 4 * 4
    for row, event in zip(tables["births"], events, strict=True):
        genes = np.frombuffer(event.genes)
        assert [row[name] for name in names] == genes.tolist()
        assert row["genes"] is None
        assert (row["number"], row["mother"]) == (event.robot, event.mother)


def test_genes_without_names_stay_in_one_column(
    tmp_path: Path, short_samples: list[TelemetrySample]
) -> None:
    """Those of a robot without known settings."""
    robot = event_messages(short_samples)[0].robot
    others = [
        sample
        for sample in short_samples
        if not (isinstance(sample, RobotMetadataSample) and sample.metadata.robot == robot)
    ]
    path = record(tmp_path / "t.sqlite", map(raw_sample, others))
    births = read(export(path, tmp_path / "out"))["births"]
    names = [gene.name for gene in schema().genes]
    messages = [m for m in event_messages(short_samples) if isinstance(m.event, Born)]
    for row, message in zip(births, messages, strict=True):
        assert isinstance(message.event, Born)
        genes = np.frombuffer(message.event.genes).tolist()
        if message.robot == robot:
            assert row["genes"] == genes
            assert {row[name] for name in names} == {None}
        else:
            assert row["genes"] is None


def test_poses_and_packs_are_those_of_every_scene(
    short_samples: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]]
) -> None:
    """A row for every robot and every pack, with position, colour and time."""
    scenes = [sample.scene for sample in short_samples if isinstance(sample, SceneSample)]
    poses, packs = iter(tables["poses"]), iter(tables["packs"])
    assert len(scenes) == 200
    for scene in scenes:
        for robot in scene.robots:
            row = next(poses)
            assert (row["arena"], row["tick"], row["period_s"]) == ("arena", scene.tick, 0.2)
            assert row["robot"] == robot.robot.hex()
            for field in ("x_m", "y_m", "heading_rad", "beacon", "red", "green", "blue", "holds"):
                assert row[field] == getattr(robot, field)
        for number, pack in enumerate(scene.packs):
            row = next(packs)
            assert (row["pack"], row["x_m"], row["y_m"]) == (number, pack.x_m, pack.y_m)
            assert row["charge"] == pack.charge
    assert next(poses, None) is next(packs, None) is None


def test_every_kind_of_event_has_its_table(tmp_path: Path) -> None:
    """An outcome without an encounter has empty columns for it."""
    kinds = {
        Met: "meetings", Exchanged: "matings", EncounterOutcome: "outcomes", Fault: "faults", Born: "births",
        Died: "deaths", Lived: "lives", TurnedOver: "turnovers",
    }  # fmt: skip
    messages = [*EVENT_MESSAGES.values(), outcome_without_encounter()]
    rows = read(export(record(tmp_path / "t.sqlite", published(messages)), tmp_path / "out"))
    for event in EVENTS.values():
        assert rows[kinds[type(event)]][0]["tick"] == event.tick
    first, second = rows["outcomes"]
    assert (first["outcome"], first["reason"]) == ("refused", "busy")
    assert first["encounter_count"] == 300
    assert second["initiator"] is second["encounter_count"] is None
    assert rows["faults"][0]["what"] == "the arena is gone"


def published(messages: Sequence[EventMessage]) -> list[RawSample]:
    keys = ColonyKeys("blue")
    return [RawSample("event", keys.event(m.robot), encode(m), m.unix_ms) for m in messages]


def outcome_without_encounter() -> EventMessage:
    event = EncounterOutcome(9, "busy", INITIATOR.id, None, "")
    return EventMessage(INITIATOR.id, 3, len(EVENT_MESSAGES) + 1, 7, event)


def test_an_event_that_arrives_twice_is_exported_once(
    tmp_path: Path, short_samples: list[TelemetrySample]
) -> None:
    """As one that is published and then sent again on request; malformed samples are not exported at all."""
    noise = [
        RawSample("event", raw_sample(short_samples[-1]).key, b"\xc1", 7),
        RawSample("state", "nobody", b"", 7),
    ]
    twice = [
        raw_sample(sample)
        for sample in short_samples
        for _ in range(2 if isinstance(sample, EventSample) else 1)
    ]
    rows = read(export(record(tmp_path / "t.sqlite", [*twice, *noise]), tmp_path / "out"))
    messages = event_messages(short_samples)
    names = ("births", "deaths", "lives", "turnovers", "meetings", "matings")
    assert sum(len(rows[name]) for name in names) == len(messages)
    assert len(rows["states"]) == sum(sample.kind == "state" for sample in short_samples)


def test_integers_that_do_not_fit_into_a_column_become_null(tmp_path: Path) -> None:
    """Anyone can publish them; the rest of the table is there."""
    huge = EventMessage(INITIATOR.id, 3, 1, 7, Died(2**64 - 1, 5, "me/1"))
    good = EventMessage(INITIATOR.id, 3, 2, 7, Died(9, 5, "me/1"))
    rows = read(export(record(tmp_path / "t.sqlite", published([huge, good])), tmp_path / "out"))
    assert [row["tick"] for row in rows["deaths"]] == [None, 9]


class TestRuns:
    """A run without a recording is re-simulated, or its telemetry is synthesised from its history."""

    def test_a_run_that_can_be_resimulated(self, tmp_path: Path, folder: Path) -> None:
        """With scenes in the wanted windows."""
        rows = read(export(folder, tmp_path / "out", Windows(frozenset({1}), 10.0)))
        assert len(rows["births"]) == 4 * 4 * 4
        assert len(rows["poses"]) == 4 * 50
        assert {row["generation"] for row in rows["states"]} == {0, 1, 2, 3}

    def test_a_run_whose_history_differs_is_exported_from_its_history(
        self, tmp_path: Path, folder: Path
    ) -> None:
        """Which is right in any case; a line reports it."""
        other = tmp_path / "other"
        other.mkdir()
        for name in ("config.toml", "history.sqlite"):
            (other / name).write_bytes((folder / name).read_bytes())
        text = (folder / "run.json").read_text()
        digest = read_run(folder).history_hash
        (other / "run.json").write_text(text.replace(digest, "00" * 16))
        lines: list[str] = []
        rows = read(export(other, tmp_path / "out", print_line=lines.append))
        assert len(lines) == 1
        assert lines[0].startswith(f"{other}: re-simulated, it has another history")
        assert len(rows["births"]) == 4 * 4 * 4
        assert rows["poses"] == []


class TestFailures:
    """A file that cannot be read, or a disk that is full, leaves what was there."""

    def test_a_source_that_cannot_be_read_leaves_no_files(
        self, tmp_path: Path, short_samples: list[TelemetrySample]
    ) -> None:
        """Not even an empty folder."""
        path = tmp_path / "t.sqlite"
        path.write_bytes(b"nonsense")
        with pytest.raises(TelemetryError, match=r"t\.sqlite: not a telemetry file"):
            export(path, tmp_path / "out")
        with pytest.raises(PastRunError, match="nowhere: there is no such file or folder"):
            export(tmp_path / "nowhere", tmp_path / "out")
        assert [one.name for one in tmp_path.iterdir()] == ["t.sqlite"]

    def test_a_full_disk_leaves_the_last_export(
        self, tmp_path: Path, short_samples: list[TelemetrySample]
    ) -> None:
        """Complete, with no drafts beside it; the error is one line."""
        path = record(tmp_path / "t.sqlite", map(raw_sample, short_samples))
        out = tmp_path / "out"
        before = {file: file.read_bytes() for file in export(path, out)}
        script = (
            "import sys; from pathlib import Path; from crcolony.recordings.export import *\n"
            "try: export(Path(sys.argv[1]), Path(sys.argv[2]))\n"
            "except ExportError as error: print(error)"
        )
        limit = 5_000
        done = subprocess.run(
            [sys.executable, "-c", script, str(path), str(out)],
            capture_output=True,
            text=True,
            timeout=60,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        )
        assert done.stdout.startswith(f"{out}: cannot be written: "), done.stderr
        assert len(done.stdout.splitlines()) == 1
        assert {file: file.read_bytes() for file in out.iterdir()} == before

    def test_without_pyarrow_the_error_says_how_to_install_it(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Before anything is done."""
        monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
        with pytest.raises(
            ExportError, match=r"export needs pyarrow: pip install 'crcolony\[viz\]'"
        ):
            export(tmp_path, tmp_path / "out")


def test_the_example_draws_an_export(tmp_path: Path, folder: Path) -> None:
    """A picture, on a machine without a screen."""
    export(folder, tmp_path / "parquet")
    picture = tmp_path / "mine.png"
    done = subprocess.run(
        [sys.executable, str(EXAMPLE), str(tmp_path / "parquet"), str(picture)],
        capture_output=True,
        text=True,
        timeout=120,
        env={"MPLBACKEND": "Agg", "MPLCONFIGDIR": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
