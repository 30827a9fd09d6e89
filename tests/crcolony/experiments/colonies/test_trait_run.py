"""A colony lives from founders, and agents take the partners that they want."""

import msgspec
import numpy as np

from crcolony.compiled import FloatArray
from crcolony.evolution.history import Mated
from crcolony.experiments.colonies.colony_run import founders_of, run_colony
from crcolony.experiments.colonies.mating_traits import CHOOSINESS, NAMES, HealthOffer
from crcolony.experiments.colonies.trait_run import TraitRun, run_with_traits
from tests.support.small_colony import small


def test_a_run_has_a_row_and_mean_traits_for_every_generation() -> None:
    """The same again for the same seed; where nobody is taken, traits change by mutation alone."""
    config = small("seed=3", "generations=2")
    lived = run_colony(config)
    founders = founders_of(lived.colony.batch.genotypes.copy(), lived.colony.schema, "founders")
    longer = msgspec.structs.replace(config, generations=3)

    def run(accepted: float) -> TraitRun:
        def accept(own: FloatArray, partner: HealthOffer) -> float:
            assert 0.0 < partner.health <= 1.0
            return accepted

        return run_with_traits(longer, founders, accept)

    taking, again, refusing = run(1.0), run(1.0), run(0.0)
    assert len(taking.rows) == 3
    assert taking.traits.shape == (3, len(NAMES))
    assert (taking.traits == again.traits).all()
    assert (taking.traits[0] == refusing.traits[0]).all()
    assert taking.accepted > 0.3
    assert refusing.accepted == 0.0
    assert np.abs(np.diff(refusing.traits[:, CHOOSINESS])).max() < 0.05


def test_selection_is_how_much_better_those_are_who_are_taken() -> None:
    """Both sides of a mating count, each for the other."""
    lived = TraitRun([], np.zeros((1, 3)), [_mated(0.2, 0.8), _mated(0.4, 0.6)])
    assert lived.accepted == 0.5
    assert np.isclose(lived.selection, 0.7 - 0.5)


def _mated(energy: float, partner_energy: float) -> Mated:
    """Return a mating in which the first one conceives, but its partner does not."""
    return Mated(
        tick=0,
        robot=0,
        partner_robot=1,
        agent="0/0",
        partner="1/0",
        energy=energy,
        partner_energy=partner_energy,
        conceived=True,
        partner_conceived=False,
    )
