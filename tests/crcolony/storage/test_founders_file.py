"""A folder keeps what its robots began with."""

from pathlib import Path

import numpy as np
import pytest

from crcolony.evolution.founders import Founders
from crcolony.evolution.population import NewAgent
from crcolony.storage.files import FolderError
from crcolony.storage.folder_record import Origin
from crcolony.storage.founders_file import FOUNDERS_FILE, Beginning, read_founders, write_founders

FOUNDERS = Founders(
    "5c", "9f", tuple((NewAgent(np.array([k, 0.5]), f"{k}@9f/1", None),) for k in (1.0, 2.0))
)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """Every gene, every name, and what they are digests of."""
    write_founders(tmp_path, FOUNDERS)
    read = read_founders(tmp_path)
    assert (read.schema, read.population) == ("5c", "9f")
    for robot in range(2):
        (agent,), (was,) = read.of_robot(robot, 1), FOUNDERS.of_robot(robot, 1)
        assert (agent.mother, agent.father) == (was.mother, None)
        assert agent.genes.tolist() == was.genes.tolist()


def test_a_missing_or_damaged_file_is_named(tmp_path: Path) -> None:
    """And stays as it is."""
    path = tmp_path / FOUNDERS_FILE
    with pytest.raises(FolderError, match=rf"{FOUNDERS_FILE}: missing"):
        read_founders(tmp_path)
    write_founders(tmp_path, FOUNDERS)
    damaged = path.read_bytes()[:-40]
    path.write_bytes(damaged)
    with pytest.raises(FolderError, match=rf"{FOUNDERS_FILE}: corrupt"):
        read_founders(tmp_path)
    assert path.read_bytes() == damaged
    path.unlink()
    path.mkdir()
    with pytest.raises(FolderError, match=FOUNDERS_FILE):
        write_founders(tmp_path, FOUNDERS)


def test_a_robot_gets_its_share_with_its_origin() -> None:
    """What the other robots begin with is not in its folder."""
    origin = Origin("/runs/1", 7, "9f")
    share = Beginning(FOUNDERS, origin).share_of(3)
    assert share.origin is origin
    assert len(share.founders.subpopulations) == 1
    assert share.founders.of_robot(0, 1)[0].mother == "2.0@9f/1"
