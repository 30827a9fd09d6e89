"""The pedigree of a run is that of its births."""

from pathlib import Path

import numpy as np
import pytest

from crcolony.results import pedigree
from crcolony.results.pedigree import NOBODY, pedigree_of, read_pedigree
from crcolony.storage.files import FolderError
from tests.support.run_folders import rows_of, run
from tests.support.small_colony import small

BIRTHS = [
    ("0/0", 0, "a", None, None),
    ("1/0", 0, "b", None, None),
    ("0/1", 1, "c", "0/0", "1/0"),
    ("0/2", 1, "c", "0/0", "1/0"),
    ("0/3", 1, "d", "0/0", "1/0"),
    ("1/1", 1, "e", "1/0", None),
    ("0/4", 2, "e", "0/2", "1/1"),
]


def test_agents_have_the_indices_of_their_parents() -> None:
    """Founders have none, a mutated copy has a mother, and one offspring that is drawn twice is known as one."""
    found = pedigree_of(BIRTHS)
    assert found.mother.tolist() == [NOBODY, NOBODY, 0, 0, 0, 1, 3]
    assert found.father.tolist() == [NOBODY, NOBODY, 1, 1, 1, NOBODY, 5]
    assert found.offspring.tolist() == [0, 1, 2, 2, 4, 5, 6]
    assert found.generation.tolist() == [0, 0, 1, 1, 1, 1, 2]
    assert [layer.tolist() for layer in found.layers] == [[0, 1], [2, 3, 4, 5], [6]]


def test_parents_come_first_in_whatever_order_births_are_recorded() -> None:
    """Robots that run apart are in different generations, and their histories are merged by time."""
    found = pedigree_of(BIRTHS[::-1])
    seen: set[int] = {NOBODY}
    for layer in found.layers:
        assert {*found.mother[layer].tolist(), *found.father[layer].tolist()} <= seen
        seen |= set(layer.tolist())
    assert len(seen) == len(BIRTHS) + 1


def test_the_pedigree_of_a_run_has_all_its_births(tmp_path: Path) -> None:
    """Every agent once, with the parents of the history."""
    run(tmp_path, small("seed=3"))
    found, births = read_pedigree(tmp_path), rows_of(tmp_path, "births")
    names = [birth[3] for birth in births]
    assert found.mother.size == len(births) == 4 * 4 * 4
    for index, (*_, mother, father) in enumerate(births):
        assert mother == (None if found.mother[index] == NOBODY else names[found.mother[index]])
        assert father == (None if found.father[index] == NOBODY else names[found.father[index]])
    twice = found.offspring != np.arange(len(births))
    assert twice.any()
    for index in np.flatnonzero(twice).tolist():
        assert births[index][5] == births[found.offspring[index]][5]


def test_a_pedigree_that_cannot_be_followed_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No history, too many agents, a parent that is not there, or agents that are their own ancestors."""
    with pytest.raises(FolderError, match=r"history\.sqlite"):
        read_pedigree(tmp_path)
    run(tmp_path / "run", small())
    monkeypatch.setattr(pedigree, "MAX_AGENTS", 10)
    with pytest.raises(FolderError, match="more than 10 agents"):
        read_pedigree(tmp_path / "run")
    with pytest.raises(KeyError, match="0/0"):
        pedigree_of(BIRTHS[1:])
    with pytest.raises(ValueError, match="own ancestors"):
        pedigree_of([("0/0", 0, "a", "0/1", None), ("0/1", 1, "b", "0/0", None)])
