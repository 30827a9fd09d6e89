"""Every registered experiment is there, and measures what it has registered."""

import pickle

import pytest

from crcolony.experiments.framework.catalogue import ExperimentError, find_experiment, summaries
from crcolony.experiments.framework.experiment import Plan
from crcolony.experiments.framework.registration import registered_names


@pytest.mark.parametrize("name", registered_names())
def test_every_experiment_measures_each_of_its_claims(name: str) -> None:
    """And nothing else; its jobs are of one condition and seed each, and can be sent to other processes."""
    experiment = find_experiment(name)
    registration = summaries()[name]
    assert set(experiment.measures) == {claim.id for claim in registration.claims}
    assert registration.seeds >= max(claim.seeds for claim in registration.claims)
    for is_quick in (False, True):
        jobs = experiment.jobs(Plan(range(1, 3), is_quick))
        assert len({(job.condition, job.seed) for job in jobs}) == len(jobs)
        pickle.dumps(jobs)


def test_an_unknown_name_is_refused_with_the_nearest_one() -> None:
    """Or with all there are, if none is near."""
    with pytest.raises(ExperimentError, match="'learning'; did you mean learning-ability"):
        find_experiment("learning")
    with pytest.raises(ExperimentError, match=r"'x'; there are .*learning-ability"):
        find_experiment("x")
