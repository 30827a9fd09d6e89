"""`crcolony inspect` prints what is in a robot's file, as text or as a table that a spreadsheet reads."""

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from crcolony.cli import main
from crcolony.config import Config, load, to_toml
from crcolony.evolution.history import Born, Event, Lived
from crcolony.protocol.encounters import EncounterRecord, EncounterState, Offer, Role
from crcolony.protocol.envelope import sign_message
from crcolony.protocol.identity import Identity
from crcolony.protocol.mating_messages import Accept, Encounter, Propose, pack_genes
from crcolony.results.inspect_robot import gene_names, inspect_robot, proof_of
from crcolony.robot.genes import agent_schema
from crcolony.storage.rows import Decision
from crcolony.storage.sql import StorageError
from crcolony.storage.store import RobotStore

ME, PEER = Identity(bytes(32)), Identity(bytes([1]) * 32)
SCHEMA = agent_schema(Config().learning, Config().heredity)
DIGEST = bytes.fromhex(SCHEMA.digest)
GENES = pack_genes(SCHEMA.random(np.random.default_rng(1)))
NONCE, TICK = 9, 40


def encountered(
    count: int, role: Role = "initiator", state: EncounterState = "mated", colony: str = "colony"
) -> EncounterRecord:
    """Return an encounter with the peer's signed message."""
    own, partner = Offer(f"{ME.id.hex()}/0", GENES), Offer(f"{PEER.id.hex()}/{count}", GENES)
    if role == "initiator":
        encounter = Encounter(ME.id, PEER.id, 1, count)
        envelope = sign_message(Accept(encounter, NONCE, DIGEST, *offered(partner)), colony, PEER)
    else:
        encounter = Encounter(PEER.id, ME.id, 1, count)
        envelope = sign_message(Propose(encounter, NONCE, DIGEST, *offered(partner)), colony, PEER)
    return EncounterRecord(encounter, role, state, NONCE, TICK, own, partner, envelope)


def offered(offer: Offer) -> tuple[str, bytes]:
    return offer.agent, offer.genes


def decision(conceived: bool) -> Decision:
    return Decision(0.5, conceived, False, GENES if conceived else b"", 7, bytes(16))


def birth(number: int, generation: int, mother: int | None, father: str | None) -> Born:
    me = ME.id.hex()
    parent = None if mother is None else f"{me}/{mother}"
    return Born(10 * generation, 0, generation, f"{me}/{number}", "hash", GENES, parent, father)


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    """Return a file with two matings, one open and one aborted encounter, two generations, and a pool of one."""
    path = tmp_path / "robot.sqlite"
    store = RobotStore(path, ME.id, DIGEST, durable=False)
    store.begin_incarnation(1)
    for count, conceived in ((1, True), (2, False)):
        record = encountered(count)
        store.write([record], record, decision(conceived))
    prepared = encountered(3, "responder", "prepared")
    store.write(
        [prepared, encountered(4, "responder", "aborted"), replace(prepared, orphaned=True)]
    )
    father = f"{PEER.id.hex()}/1"
    child = (np.frombuffer(GENES), f"{ME.id.hex()}/1", father, 7)
    events: list[Event] = [
        birth(0, 0, None, None),
        Lived(10, 0, 0, f"{ME.id.hex()}/0", 300, 0.25, 4, 2),
        birth(1, 1, 0, father),
    ]
    store.save({"generation": 1, "subpopulation": {"pool": [child]}}, events, 55)
    store.close()
    return path


def table(capsys: pytest.CaptureFixture[str], stored: Path, name: str) -> list[dict[str, str]]:
    inspect_robot(stored, name)
    return list(csv.DictReader(io.StringIO(capsys.readouterr().out)))


def test_the_summary_names_the_robot_and_its_matings(
    stored: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Robot, incarnation, generation, tick, encounters by outcome, matings by partner, pool, messages and lineage."""
    inspect_robot(stored, None)
    printed = capsys.readouterr().out
    peer = PEER.id.hex()[:8]
    for text in (
        f"file of robot {ME.id.hex()}",
        "incarnation 1, generation 1, saved ",
        " at tick 55",
        "encounters: 4 (2 mated, 1 prepared, 1 aborted)",
        "matings: 2 with 1 partner, 1 offspring",
        f"  {peer}: 2 matings, 1 offspring",
        "open encounters: 1",
        f"with {peer} since tick 40: in doubt, orphaned",
        "offspring pool: 1",
        "partners' signed messages: 4 of 4 valid for colony colony",
        f"  {ME.id.hex()[:8]}/1 ← {ME.id.hex()[:8]}/0 × {peer}/1",
    ):
        assert text in printed


def test_a_new_file_has_a_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Also when nothing is saved yet."""
    path = tmp_path / "robot.sqlite"
    RobotStore(path, ME.id, DIGEST, durable=False).close()
    inspect_robot(path, None)
    printed = capsys.readouterr().out
    assert "nothing saved yet" in printed
    assert "no agent is born yet" in printed


def test_the_table_of_matings_names_genes_and_checks_signatures(
    stored: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A row for each encounter, with the offspring's genes in columns of their names."""
    rows = table(capsys, stored, "matings")
    assert [row["state"] for row in rows] == ["mated", "mated", "prepared", "aborted"]
    assert [row["conceived"] for row in rows] == ["1", "0", "", ""]
    assert {row["proof"] for row in rows} == {"signed"}
    genes = np.array([float(rows[0][gene.name]) for gene in SCHEMA.genes])
    assert pack_genes(genes) == GENES
    assert rows[1]["mating.tau"] == ""


def test_signatures_are_checked_for_the_colony_that_the_file_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the summary and in the table: a message for the reds is valid in a file of the reds."""
    path = tmp_path / "robot.sqlite"
    store = RobotStore(path, ME.id, DIGEST, durable=False)
    record = encountered(1, colony="reds")
    store.write([record], record, decision(True))
    store.save({"generation": 0, "colony": "reds"}, [], 55)
    store.close()
    inspect_robot(path, None)
    assert "partners' signed messages: 1 of 1 valid for colony reds" in capsys.readouterr().out
    (row,) = table(capsys, path, "matings")
    assert row["proof"] == "signed"


def test_tables_of_births_lives_and_pool_hold_what_the_file_holds(
    stored: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every birth with its genes, every lifetime with its numbers, every offspring in the pool with its parents."""
    births = table(capsys, stored, "births")
    assert [row["generation"] for row in births] == ["0", "1"]
    assert births[1]["father"] == f"{PEER.id.hex()}/1"
    (lifetime,) = table(capsys, stored, "lives")
    assert (lifetime["steps"], lifetime["energy"], lifetime["captures"], lifetime["matings"]) == (
        "300", "0.25", "4", "2",
    )  # fmt: skip
    (child,) = table(capsys, stored, "pool")
    assert child["step"] == "7"
    assert float(child["foraging.alpha"]) == np.frombuffer(GENES)[SCHEMA.index("foraging.alpha")]


def test_genes_are_named_after_the_config_that_fits(
    tmp_path: Path,
) -> None:
    """The default config, or config.toml of the results folder; without one that fits genes have no names."""
    config = load(None, ["learning.potential_distances=2"])
    other = agent_schema(config.learning, config.heredity)
    folder = tmp_path / "robots" / "0"
    folder.mkdir(parents=True)
    path = folder / "robot.sqlite"
    assert gene_names(path, bytes.fromhex(other.digest)) == []
    (tmp_path / "config.toml").write_text(to_toml(config))
    assert gene_names(path, bytes.fromhex(other.digest)) == [gene.name for gene in other.genes]


def test_a_message_that_does_not_match_its_record_is_found() -> None:
    """Other genes, another agent, or no message at all are a `mismatch`; a signature for another colony is `other`."""
    record = encountered(1)
    assert proof_of(record, "colony") == "signed"
    assert proof_of(record, "elsewhere") == "other"
    assert proof_of(encountered(1, colony="elsewhere"), "colony") == "other"
    other = Offer("unknown/1", GENES)
    assert proof_of(replace(record, partner=other), "colony") == "mismatch"
    assert proof_of(replace(record, proof=record.proof[:-1]), "colony") == "mismatch"
    assert proof_of(replace(record, proof=encountered(2).proof), "colony") == "mismatch"


def test_a_file_of_another_kind_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A missing file and a text end with exit code 2 and a line that names the file."""
    path = tmp_path / "notes.txt"
    with pytest.raises(StorageError, match="no such file"):
        inspect_robot(path, None)
    path.write_text("these are notes")
    assert main(["inspect", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(path) in line


def test_a_file_of_the_former_name_is_found(
    stored: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By its present name, and by its former one."""
    inspect_robot(stored, None)
    expected = capsys.readouterr().out
    former = stored.rename(stored.with_name("memory.sqlite"))
    for path in (stored, former):
        inspect_robot(path, None)
        assert capsys.readouterr().out == expected
    assert not stored.exists()
