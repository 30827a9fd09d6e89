"""All that changes in a world is saved, and what earlier versions saved stays readable."""

import numpy as np

from crcolony.world.state import FORMER_NAMES, SAVED, World, with_present_names
from tests.support.small_arenas import new_arena


def test_every_former_name_leads_to_a_saved_field() -> None:
    """No present field has a name that once meant another one."""
    assert set(SAVED) <= set(World._fields)
    assert set(FORMER_NAMES.values()) <= set(SAVED)
    assert not set(FORMER_NAMES) & set(World._fields)


def test_present_names_are_left_alone() -> None:
    """A checkpoint of this version passes unchanged."""
    saved = new_arena().save()
    assert with_present_names(saved).keys() == saved.keys()


def test_a_checkpoint_of_an_earlier_version_is_restored() -> None:
    """One whose fields have their former names gives the same world."""
    one, other = new_arena(3, seed=1), new_arena(3, seed=2)
    for _ in range(5):
        one.integrate()
        one.observe()
    saved = one.save()
    former = {name: former for former, name in FORMER_NAMES.items()}
    arrays = {former.get(name, name): value for name, value in saved.items()}
    assert {"speeds", "wheels", "left_s"} <= set(arrays)
    other.restore(arrays)
    for name, value in other.save().items():
        assert np.array_equal(value, saved[name]), name
