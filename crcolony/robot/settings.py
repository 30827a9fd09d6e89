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
Selection = Literal["implicit", "central", "pgta", "pega", "medea", "ompac", "gpbt_pl"]


class Learning(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sarsa(lambda) with tile coding and potential-based shaping, the same in every learning
    module."""

    tilings: Tiles = 7
    """Tilings of tile coding, each shifted against the others."""
    distance_tiles: Tiles = 7
    """Tiles of a tiling along the distance of what is seen."""
    bearing_tiles: Tiles = 13
    """Tiles of a tiling along the bearing of what is seen."""
    initial_value: Annotated[float, Meta(ge=-100.0, le=100.0)] = 0.0
    """What a newborn's action values start from; above 0 is optimistic."""
    shaping: bool = True
    """Whether potentials shape rewards; false: all potentials are 0, in every generation."""
    potential_distances: Tiles = 4
    """Radial basis functions of a potential along the distance."""
    potential_bearings: Tiles = 4
    """Radial basis functions of a potential along the bearing."""
    speeds_m_s: tuple[Rate, ...] = (0.0, 0.15, 0.3)
    """Speeds of the actions, which are all pairs of a speed and a turning rate."""
    turns_rad_s: tuple[Rate, ...] = (-1.0, 0.0, 1.0)
    """Turning rates of the actions; above 0 turns left."""
    jaw_modules: tuple[Literal["foraging", "mating"], ...] = ("foraging",)
    """The modules in which the jaw closes, as a reflex, on a pack in reach."""
    visible_mates: Literal["any", "lit", "ready"] = "lit"
    """Which faces the mating module regards as visible: any; those with a lamp on, which a dead
    robot has not; or those that show the mating module's own lamp."""
    action_ttl_s: Annotated[float, Meta(gt=0.0, le=10.0)] = 0.5
    """Time to live of an action: a body without a fresh one stops its wheels after it."""


class Life(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Time sharing, energy, and mating."""

    agents: Count = 20
    """Virtual agents in a robot's subpopulation."""
    slices: Count = 12
    """How often each agent controls the robot in a generation."""
    slice_steps: Annotated[int, Meta(ge=2, le=1_000_000)] = 100
    """Control steps in a slice."""
    time_sharing: Literal["random", "epsilon_greedy", "softmax"] = "random"
    """How the next agent in control is chosen; the last two prefer agents that have mated more."""
    exploration: Share = 0.25
    """Epsilon, or the temperature, of the two informed ways of time sharing."""
    initial_energy: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.5
    """Energy of a newborn agent; 1 is full, at 0 it dies."""
    energy_per_step: Share = 0.001
    """Energy that a control step costs."""
    refractory_steps: Annotated[int, Meta(ge=0, le=100_000)] = 25
    """After a mating the beacon stays off, and faces count as not visible, for so many control
    steps."""
    conception_threshold: Share = 0.0
    """Below this energy a mating gives no offspring."""
    conception_exponent: NotNegative = 1.0
    """A mating gives offspring with probability energy ** exponent."""


class Heredity(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How an offspring's genotype comes from its parents', and what newborns start from."""

    crossover: Literal["one_point", "two_point", "uniform"] = "uniform"
    """How an offspring's genes are taken from its two parents."""
    mutation_probability: Share = 0.1
    """Probability that a gene of an offspring mutates."""
    pool_limit: Annotated[int, Meta(ge=1, le=1_000_000)] = 1000
    """Offspring that a robot keeps at most; beyond it a new one replaces a random one."""
    selector_sd: NotNegative = 0.5
    """Standard deviation of the selector's genes in the first generation."""
    selector_mutation_sd: NotNegative = 0.3
    """Standard deviation of a mutation of the selector's genes."""
    highest_selector: NotNegative = 3.0
    """Selector genes stay within plus and minus this; 0: without bounds. Only their ratios matter,
    so that nothing else keeps them from drifting away."""
    meta_mutation_sd: NotNegative = 0.15
    """Standard deviation of a mutation of a meta-parameter, but for the temperature's decay."""
    highest_alpha: Share = 1.0
    """Highest learning rate alpha; the first generation is uniform from 0 to it."""
    highest_gamma: Share = 0.999
    """Highest discount factor gamma; the first generation is uniform from 0 to it."""
    highest_lambda: Share = 1.0
    """Highest trace decay lambda; the first generation is uniform from 0 to it."""
    highest_tau: NotNegative = 1.0
    """Highest temperature tau; the first generation is uniform from 0 to it."""
    highest_tau_decay: NotNegative = 0.2
    """Highest decay of the temperature; the first generation is uniform from 0 to it."""
    tau_decay_mutation_sd: NotNegative = 0.03
    """Standard deviation of a mutation of the temperature's decay."""
    potential_sd: NotNegative = 0.3
    """Standard deviation of the potentials' genes in the first generation."""
    potential_mutation_sd: NotNegative = 0.2
    """Standard deviation of a mutation of the potentials' genes."""


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
    def selection(self) -> Selection: ...

    @property
    def seed(self) -> int: ...
