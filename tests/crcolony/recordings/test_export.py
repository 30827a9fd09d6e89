"""Tables hold what was heard: every value in its column, every event once, and all of it or nothing."""

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
    decode_scene,
    decode_state,
)
from crcolony.recordings.export import ExportError, export
from crcolony.recordings.past_run import PastRunError, read_run
from crcolony.recordings.resimulation import Windows, resimulate
from crcolony.recordings.telemetry_file import TelemetryError, TelemetryFile
from crcolony.robot.genes import agent_schema
from crcolony.telemetry.colony_monitor import TelemetrySample
from tests.support.runs import run, told_in
from tests.support.small_colony import small
from tests.vectors.make import EVENT_MESSAGES, EVENTS, INITIATOR

EXAMPLE = Path("examples/foraging_and_mating.py").absolute()
TABLES = {
    "states", "births", "deaths", "lives", "turnovers", "meetings", "matings", "outcomes",
    "faults", "poses", "packs",
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in which every robot mates."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    run(folder, small("seed=10"))
    return folder


@pytest.fixture(scope="module")
def sample(folder: Path) -> list[TelemetrySample]:
    return list(resimulate(read_run(folder), Windows(frozenset({0, 2}), 20.0)))


@pytest.fixture(scope="module")
def tables(
    tmp_path_factory: pytest.TempPathFactory, sample: list[TelemetrySample]
) -> dict[str, list[dict[str, Any]]]:
    """What a recording of it is exported to."""
    folder = tmp_path_factory.mktemp("recorded")
    record(folder / "telemetry.sqlite", sample)
    return read(export(folder, folder / "parquet"))


def record(path: Path, sample: Sequence[TelemetrySample]) -> Path:
    file = TelemetryFile.open(path)
    for one in sample:
        file.add(one)
    assert file.close() is None
    return path


def read(paths: Sequence[Path]) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of all tables by the names of their files."""
    return {path.stem: pq.read_table(path).to_pylist() for path in paths}


def schema() -> Schema:
    config = small()
    return agent_schema(config.learning, config.heredity)


def test_there_is_a_table_for_everything(tables: dict[str, list[dict[str, Any]]]) -> None:
    """Also where nothing of it was heard."""
    assert tables.keys() == TABLES
    assert tables["outcomes"] == tables["faults"] == []


def test_states_are_as_they_were_told(
    sample: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]]
) -> None:
    """Field by field, with the id as hex digits, beside colony and time."""
    states = [(one.unix_ms, decode_state(one.data)) for one in sample if one.kind == "state"]
    assert tables["states"] == [
        {
            "heard_unix_ms": unix_ms,
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
def test_events_are_as_they_were_told(
    sample: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]], name: str, kind: type
) -> None:
    """Each once, in order, with who told it."""
    message = [t for t in told_in(sample) if isinstance(t.event, kind)]
    assert name == "deaths" or message
    for row, one in zip(tables[name], message, strict=True):
        fields = msgspec.structs.asdict(one.event)
        if "peer" in fields:
            fields["peer"] = fields["peer"].hex()
        else:
            fields["number"] = fields.pop("robot")
        head = {
            "heard_unix_ms": one.unix_ms,
            "colony": "colony",
            "robot": one.robot.hex(),
            "incarnation": one.incarnation,
            "seq": one.seq,
            "unix_ms": one.unix_ms,
        }
        assert row == {**head, **fields}


def test_a_mating_is_told_by_both(
    sample: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]]
) -> None:
    """Each side with its own energy and decision, and the same encounter."""
    message = [t.event for t in told_in(sample) if isinstance(t.event, Exchanged)]
    rows = tables["matings"]
    assert len(rows) == len(message) >= 10
    for row, event in zip(rows, message, strict=True):
        assert isinstance(event, Exchanged)
        encounter = event.encounter
        assert row["initiator"] == encounter.initiator.hex()
        assert row["responder"] == encounter.responder.hex()
        assert (row["encounter_incarnation"], row["encounter_count"]) == encounter.number
        for field in ("tick", "agent", "partner", "energy", "conceived", "too_late"):
            assert row[field] == getattr(event, field)
    names = ("initiator", "encounter_incarnation", "encounter_count")
    assert len({tuple(row[name] for name in names) for row in rows}) == len(rows) // 2


def test_births_have_a_column_for_every_gene(
    sample: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]]
) -> None:
    """By its name in the schema, since robots have told their settings."""
    names = [gene.name for gene in schema().genes]
    message = [t.event for t in told_in(sample) if isinstance(t.event, Born)]
    assert len(message) == 4 * 4 * 4
    for row, event in zip(tables["births"], message, strict=True):
        assert isinstance(event, Born)
        genes = np.frombuffer(event.genes)
        assert [row[name] for name in names] == genes.tolist()
        assert row["genes"] is None
        assert (row["number"], row["mother"]) == (event.robot, event.mother)


def test_genes_without_names_stay_together(tmp_path: Path, sample: list[TelemetrySample]) -> None:
    """Of a robot that has not told its settings."""
    robot = told_in(sample)[0].robot
    silent = [h for h in sample if not (h.kind == "metadata" and robot.hex() in h.key)]
    path = record(tmp_path / "t.sqlite", silent)
    births = read(export(path, tmp_path / "out"))["births"]
    names = [gene.name for gene in schema().genes]
    for row, message in zip(
        births, (t for t in told_in(sample) if isinstance(t.event, Born)), strict=True
    ):
        assert isinstance(message.event, Born)
        genes = np.frombuffer(message.event.genes).tolist()
        if message.robot == robot:
            assert row["genes"] == genes
            assert {row[name] for name in names} == {None}
        else:
            assert row["genes"] is None


def test_poses_and_packs_are_those_of_every_scene(
    sample: list[TelemetrySample], tables: dict[str, list[dict[str, Any]]]
) -> None:
    """A row for everybody, with where, what and when."""
    scenes = [decode_scene(one.data) for one in sample if one.kind == "scene"]
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
    """One of each goes where it belongs; the outcome of nothing has no encounter."""
    kinds = {
        Met: "meetings", Exchanged: "matings", EncounterOutcome: "outcomes", Fault: "faults", Born: "births",
        Died: "deaths", Lived: "lives", TurnedOver: "turnovers",
    }  # fmt: skip
    message = [*EVENT_MESSAGES.values(), ended_without_encounter()]
    rows = read(export(record(tmp_path / "t.sqlite", said(message)), tmp_path / "out"))
    for event in EVENTS.values():
        assert rows[kinds[type(event)]][0]["tick"] == event.tick
    first, second = rows["outcomes"]
    assert (first["outcome"], first["reason"]) == ("refused", "busy")
    assert first["encounter_count"] == 300
    assert second["initiator"] is second["encounter_count"] is None
    assert rows["faults"][0]["what"] == "the arena is gone"


def said(message: Sequence[EventMessage]) -> list[TelemetrySample]:
    keys = ColonyKeys("blue")
    return [TelemetrySample("event", keys.event(t.robot), encode(t), t.unix_ms) for t in message]


def ended_without_encounter() -> EventMessage:
    event = EncounterOutcome(9, "busy", INITIATOR.id, None, "")
    return EventMessage(INITIATOR.id, 3, len(EVENT_MESSAGES) + 1, 7, event)


def test_what_is_heard_twice_is_exported_once(
    tmp_path: Path, sample: list[TelemetrySample]
) -> None:
    """As an event that is told and then asked for; and what is malformed is not exported at all."""
    noise = [
        TelemetrySample("event", sample[-1].key, b"\xc1", 7),
        TelemetrySample("state", "nobody", b"", 7),
    ]
    twice = [one for h in sample for one in ([h, h] if h.kind == "event" else [h])]
    rows = read(export(record(tmp_path / "t.sqlite", [*twice, *noise]), tmp_path / "out"))
    message = told_in(sample)
    names = ("births", "deaths", "lives", "turnovers", "meetings", "matings")
    assert sum(len(rows[name]) for name in names) == len(message)
    assert len(rows["states"]) == sum(one.kind == "state" for one in sample)


def test_numbers_that_fit_into_no_column_are_left_out(tmp_path: Path) -> None:
    """Anybody can tell them; the rest of the table is there."""
    huge = EventMessage(INITIATOR.id, 3, 1, 7, Died(2**64 - 1, 5, "me/1"))
    good = EventMessage(INITIATOR.id, 3, 2, 7, Died(9, 5, "me/1"))
    rows = read(export(record(tmp_path / "t.sqlite", said([huge, good])), tmp_path / "out"))
    assert [row["tick"] for row in rows["deaths"]] == [None, 9]


class TestRuns:
    """Of a run that nobody recorded, what is exported is lived again, or told from its history."""

    def test_one_that_can_be_lived_again(self, tmp_path: Path, folder: Path) -> None:
        """With the arena in the windows that are asked for."""
        rows = read(export(folder, tmp_path / "out", Windows(frozenset({1}), 10.0)))
        assert len(rows["births"]) == 4 * 4 * 4
        assert len(rows["poses"]) == 4 * 50
        assert {row["generation"] for row in rows["states"]} == {0, 1, 2, 3}

    def test_one_that_comes_out_otherwise_is_told_from_its_history(
        self, tmp_path: Path, folder: Path
    ) -> None:
        """Which is true in any case; and that is said."""
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
        assert lines[0].startswith(f"{other}: lived again it has another history")
        assert len(rows["births"]) == 4 * 4 * 4
        assert rows["poses"] == []


class TestFailures:
    """A file that cannot be read, or a disk that is full, leaves what was there."""

    def test_what_cannot_be_read_leaves_nothing(
        self, tmp_path: Path, sample: list[TelemetrySample]
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
        self, tmp_path: Path, sample: list[TelemetrySample]
    ) -> None:
        """Whole, in one line, and no drafts beside it."""
        path = record(tmp_path / "t.sqlite", sample)
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

    def test_without_pyarrow_it_is_said_how_to_get_it(
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
