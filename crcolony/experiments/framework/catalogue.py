"""All experiments by name: one whose claims are registered is there, and is imported only when it is asked for."""

from importlib import import_module

from crcolony.errors import CrcolonyError, did_you_mean
from crcolony.experiments.framework.experiment import Experiment
from crcolony.experiments.framework.registration import (
    Registration,
    parse_registration,
    registered_names,
    registration_text,
)


class ExperimentError(CrcolonyError):
    """An experiment cannot be run as asked: the message says why."""


def find_experiment(name: str) -> Experiment:
    """Return the experiment of a name; raises ExperimentError, with the nearest name, if there is none."""
    names = registered_names()
    if name not in names:
        near = did_you_mean(name, names) or f"; there are {', '.join(names)}"
        raise ExperimentError(f"there is no experiment {name!r}{near}")
    module = import_module(f"crcolony.experiments.{name.replace('-', '_')}")
    experiment: Experiment = module.EXPERIMENT
    assert experiment.name == name, f"{module.__name__} is called {experiment.name!r}"
    return experiment


def summaries() -> dict[str, Registration]:
    """Return the registrations of all experiments by name."""
    return {name: parse_registration(registration_text(name)) for name in registered_names()}
