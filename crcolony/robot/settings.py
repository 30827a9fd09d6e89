"""The settings of a robot: how it learns, lives and reproduces. By default a colony evolves."""

from typing import Annotated, Literal, Protocol

import msgspec
from msgspec import Meta

from crcolony.body.settings import CyberRodent

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
NotNegative = Annotated[float, Meta(ge=0.0, le=1e6)]
Rate = Annotated[float, Meta(ge=-100.0, le=100.0)]
Count = Annotated[int, Meta(ge=1, le=1000)]
Tiles = Annotated[int, Meta(ge=1, le=100)]


class Learning(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sarsa(lambda) with tile coding and potential-based shaping, the same in every learning
    module."""

    tilings: Tiles = 6
    distance_tiles: Tiles = 7
    bearing_tiles: Tiles = 13
    initial_value: Annotated[float, Meta(ge=-100.0, le=100.0)] = 0.0
    """What a newborn's action values start from; above 0 is optimistic."""
    shaping: bool = True
    """False: the potential genes are absent (all potentials are 0)."""
    potential_distances: Tiles = 4
    potential_bearings: Tiles = 4
    speeds_m_s: tuple[Rate, ...] = (0.0, 0.15, 0.3)
    turns_rad_s: tuple[Rate, ...] = (-1.0, 0.0, 1.0)
    """The actions are all pairs of a speed and a turning rate."""
    action_ttl_s: Annotated[float, Meta(gt=0.0, le=10.0)] = 0.5


class Life(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Time sharing, energy, and mating."""

    agents: Count = 20
    """Virtual agents in a robot's subpopulation."""
    slices: Count = 3
    """How often each agent controls the robot in a generation."""
    slice_steps: Annotated[int, Meta(ge=2, le=1_000_000)] = 400
    """Control steps in a slice."""
    time_sharing: Literal["random", "epsilon_greedy", "softmax"] = "random"
    exploration: Share = 0.25
    """Epsilon, or the temperature, of the two informed ways of time sharing."""
    initial_energy: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.5
    energy_per_step: Share = 0.001
    refractory_steps: Annotated[int, Meta(ge=0, le=100_000)] = 25
    """After a mating the beacon stays off, and faces count as not visible, for so many control
    steps."""
    conception_threshold: Share = 0.0
    conception_exponent: NotNegative = 1.0
    """Conception has probability energy ** exponent, and none below the threshold."""


class Heredity(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How an offspring's genotype comes from its parents', and what newborns start from."""

    crossover: Literal["one_point", "two_point", "uniform"] = "two_point"
    mutation_probability: Share = 0.1
    pool_limit: Annotated[int, Meta(ge=1, le=1_000_000)] = 1000
    """Offspring that a robot keeps at most; beyond it a new one replaces a random one."""
    selector_sd: NotNegative = 0.5
    selector_mutation_sd: NotNegative = 0.3
    meta_mutation_sd: NotNegative = 0.15
    highest_alpha: Share = 1.0
    highest_gamma: Share = 0.999
    highest_lambda: Share = 1.0
    highest_tau: NotNegative = 1.0
    highest_tau_decay: NotNegative = 0.2
    """Meta-parameters of the first generation are uniform from 0 to these; they never exceed
    them."""
    tau_decay_mutation_sd: NotNegative = 0.03
    potential_sd: NotNegative = 0.3
    potential_mutation_sd: NotNegative = 0.2


class RobotSettings(Protocol):
    """All that decides what a robot is, wherever it is read from; `crcolony.config.Config`
    is one."""

    @property
    def learning(self) -> Learning: ...

    @property
    def life(self) -> Life: ...

    @property
    def heredity(self) -> Heredity: ...

    @property
    def body(self) -> CyberRodent: ...

    @property
    def seed(self) -> int: ...
