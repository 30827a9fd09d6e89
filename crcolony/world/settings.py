"""The settings of the arena and its packs, in SI units with checked ranges."""

from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.body.settings import Angle, NotNegative, Positive

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Coordinate = Annotated[float, Meta(ge=-1e4, le=1e4)]


class ArenaSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The shared world: a rectangle with walls, obstacles and battery packs."""

    width_m: NotNegative = 0.0
    """Width of the arena; 0: a square of `area_per_robot_m2` for every robot."""
    height_m: NotNegative = 0.0
    """Height of the arena; 0: as high as wide."""
    area_per_robot_m2: Positive = 1.21
    """Area of the arena for every robot, where no width is given."""
    packs: Annotated[int, Meta(ge=0, le=100_000)] = 0
    """Battery packs in the arena; 0: `packs_per_robot` for every robot."""
    packs_per_robot: NotNegative = 2.0
    """Battery packs for every robot, where no number of packs is given."""
    pack_charge: Share = 0.4
    """Energy in a full pack; an empty one is replaced by a full one elsewhere."""
    pack_charge_per_step: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.4
    """How much of it a jaw takes in one control period."""
    pack_wall_margin_m: NotNegative = 0.2
    """A replaced pack appears at least this far from the outer walls."""
    pack_clearance_m: NotNegative = 0.3
    """A replaced pack appears at least this far from every robot and pack, where there is room."""
    pillars: tuple[tuple[Coordinate, Coordinate, Positive], ...] = ()
    """Round obstacles: x, y, radius, in metres from the middle of the arena."""
    inner_walls: tuple[tuple[Coordinate, Coordinate, Coordinate, Coordinate], ...] = ()
    """Straight obstacles: from x, y to x, y, in metres from the middle of the arena."""
    wall_turn_rad: Angle = 1.0
    """Reflex: a robot that touches an outer wall turns by a random angle up to this; 0: walls only
    stop it."""
    control_period_s: Positive = 0.2
    """Simulated time between two observations."""
    physics_steps: Annotated[int, Meta(ge=1, le=100)] = 1
    """Physics steps in a control period, at least: there are more where a fast robot would jump
    over a wall."""
