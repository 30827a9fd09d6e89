"""The robots of an earlier run are read from its folder, whatever made it, and also while it is used."""

import os
from pathlib import Path

import numpy as np
import pytest

from crcolony.evolution.founders import founder_name
from crcolony.evolution.history import Born
from crcolony.in_process.run import start_run
from crcolony.results.earlier_run import EarlierRunError, read_earlier_run
from crcolony.storage.files import FolderError
from crcolony.storage.folder_record import FolderRecord, write_record
from crcolony.storage.sql import StorageError
from crcolony.storage.store import RobotStore
from tests.support.run_folders import run
from tests.support.small_colony import small


@pytest.fixture(scope="module")
def evolved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of three generations of four robots with four agents."""
    return run(tmp_path_factory.mktemp("runs") / "1", small()).folder


def test_the_newest_generation_is_taken_unless_another_is_named(evolved: Path) -> None:
    """Its agents were born at the end of the last one that ended."""
    newest = read_earlier_run(evolved)
    assert [len(births) for births in newest.subpopulations] == [4, 4, 4, 4]
    assert {born.generation for births in newest.subpopulations for born in births} == {3}
    assert newest.origin.run == str(evolved)
    assert newest.origin.generation == 3
    first = read_earlier_run(evolved, 0)
    assert {born.agent for born in first.subpopulations[2]} == {f"2/{k}" for k in range(4)}
    assert first.origin.population != newest.origin.population


@pytest.mark.parametrize("generation", [-1, 4])
def test_a_generation_that_is_not_there_is_refused(evolved: Path, generation: int) -> None:
    """The line says which there are."""
    with pytest.raises(EarlierRunError, match=f"--generation {generation}: .* are 0 to 3"):
        read_earlier_run(evolved, generation)


def test_founders_are_the_agents_of_the_run(evolved: Path) -> None:
    """With the same genes, and named by their origin."""
    earlier = read_earlier_run(evolved)
    beginning = earlier.beginning(small())
    born = earlier.subpopulations[1][2]
    founder = beginning.founders.of_robot(1, 4)[2]
    assert founder.mother == founder_name(born.agent, earlier.origin.population)
    assert np.array_equal(founder.genes, np.frombuffer(born.genes))


def test_robots_with_other_genes_are_refused_by_name(evolved: Path) -> None:
    """Fewer potentials, another range, or shaping that is switched off."""
    earlier = read_earlier_run(evolved)
    for setting, line in (
        ("learning.potential_distances=3", r"only there: foraging\.potential\.12"),
        ("heredity.highest_tau=2.0", r"foraging\.tau \(0 to 1 there, 0 to 2 here\)"),
        ("learning.shaping=false", r"switched off here: foraging\.potential\.0"),
    ):
        with pytest.raises(EarlierRunError, match=line):
            earlier.beginning(small(setting))


def test_what_is_dealt_out_is_said(evolved: Path) -> None:
    """More or fewer robots, more or fewer agents."""
    earlier = read_earlier_run(evolved)
    line = f"robots begin with generation 3 of {evolved}"
    assert earlier.describe(4, 4) == line
    assert earlier.describe(8, 4).endswith("of 4 robots dealt out again to 8")
    assert earlier.describe(3, 2).endswith(
        "of the first 3 of 4 robots, the first 2 of 4 agents of each"
    )
    assert earlier.describe(4, 6).endswith("4 agents of each dealt out again to 6")


def test_a_run_that_goes_on_is_read_and_not_disturbed(tmp_path: Path) -> None:
    """Every generation that is on the disk, and the run writes the next one meanwhile."""
    results, colony = start_run(tmp_path / "run", small())
    for generation in range(3):
        assert read_earlier_run(results.folder).origin.generation == generation
        while colony.generation == generation:
            colony.run(10_000)
        results.write_generation(colony.summary)
    results.close()
    undisturbed = run(tmp_path / "other", small())
    assert str(results.hash) == str(undisturbed.hash)


def _robot_with_births(folder: Path, robot: int, generations: int) -> None:
    """Write the file of a robot that has had so many generations of two agents."""
    folder.mkdir(parents=True)
    identity = bytes([robot] * 16)
    name = identity.hex()
    events = [
        Born(g, robot, g, f"{name}/{2 * g + k}", "", bytes(8), None, None)
        for g in range(generations)
        for k in range(2)
    ]
    store = RobotStore(folder / "robot.sqlite", identity, bytes(16), durable=False)
    store.save({}, events, generations)
    store.close()


def test_robots_of_a_launch_give_their_own_newest_generation(tmp_path: Path) -> None:
    """One may be slower, or have joined later; only what all have can be named."""
    for robot, generations in ((0, 4), (1, 2)):
        _robot_with_births(tmp_path / "robots" / str(robot), robot, generations)
    write_record(tmp_path, FolderRecord("launch"))
    agents = [[b.agent for b in births] for births in read_earlier_run(tmp_path).subpopulations]
    assert agents == [["0/6", "0/7"], ["1/2", "1/3"]]
    with pytest.raises(EarlierRunError, match="are 0 to 1"):
        read_earlier_run(tmp_path, 2)
    alone = read_earlier_run(tmp_path / "robots" / "1")
    assert [born.agent for born in alone.subpopulations[0]] == ["0/2", "0/3"]
    assert alone.config_file is None


def test_what_is_no_run_is_refused_with_what_would_work(tmp_path: Path) -> None:
    """Nothing there, a file, a sweep, an arena, a folder of anything, and robots before their birth."""
    (tmp_path / "sweep" / "implicit" / "seed-3").mkdir(parents=True)
    for name, maker in (("sweep", "evolve --seeds"), ("arena", "arena"), ("launch", "launch")):
        (tmp_path / name).mkdir(exist_ok=True)
        write_record(tmp_path / name, FolderRecord(maker))  # type: ignore[arg-type]
    for name, line in (
        ("missing", "there is no such folder"),
        ("arena/made_by.toml", f"a file; give the folder of the run: {tmp_path}/arena"),
        ("sweep", f"holds the 1 runs of a sweep; give one .*{tmp_path}/sweep/implicit/seed-3"),
        ("arena", "made by crcolony arena; give that of an evolve, a launch or a host"),
        (".", "not the folder of a run; give that of an evolve, a launch or a host"),
        ("launch", "none of its robots has been born yet"),
    ):
        with pytest.raises(EarlierRunError, match=line):
            read_earlier_run(tmp_path / name)


def test_a_damaged_or_missing_file_is_named(tmp_path: Path) -> None:
    """A history, or the file of a robot."""
    results = run(tmp_path / "run", small("generations=1"))
    history = results.folder / "history.sqlite"
    os.truncate(history, 5000)
    with pytest.raises(FolderError, match=r"history\.sqlite: cannot be read"):
        read_earlier_run(results.folder)
    history.unlink()
    with pytest.raises(FolderError, match=r"history\.sqlite: missing"):
        read_earlier_run(results.folder)
    _robot_with_births(tmp_path / "robot", 1, 1)
    (tmp_path / "robot" / "robot.sqlite").write_bytes(b"nonsense" * 1000)
    with pytest.raises(StorageError, match=r"robot\.sqlite: not a crcolony robot file"):
        read_earlier_run(tmp_path / "robot")
