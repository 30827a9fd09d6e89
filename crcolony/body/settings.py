"""The settings of a body: the Cyber Rodent of thesis 4.6, in SI units with checked ranges."""

from typing import Annotated

import msgspec
from msgspec import Meta

WHEEL_LIMIT_M_S = 1.3
"""The highest speed of a wheel."""

Positive = Annotated[float, Meta(gt=0.0, le=1e4)]
NotNegative = Annotated[float, Meta(ge=0.0, le=1e4)]
Angle = Annotated[float, Meta(ge=0.0, le=3.141592653589793)]

Steps = Annotated[int, Meta(ge=0, le=100)]


class Noise(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Standard deviations of the noise that is added to readings; 0 costs no time."""

    distance_m: NotNegative = 0.0
    bearing_rad: NotNegative = 0.0
    proximity_m: NotNegative = 0.0
    gyro_rad_s: NotNegative = 0.0
    acceleration_m_s2: NotNegative = 0.0
    wheel_m_s: NotNegative = 0.0


class CyberRodent(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The body of thesis 4.6: 22 cm, 1.75 kg, two wheels, at most 1.3 m/s. A sense that is off
    costs no time."""

    radius_m: Positive = 0.11
    mass_kg: Positive = 1.75
    track_m: Positive = 0.16
    """Distance between the wheels."""
    camera: bool = True
    camera_range_m: Positive = 1.5
    camera_half_angle_rad: Angle = 1.3089969389957472
    occlusion: bool = True
    """Bodies, pillars and inner walls hide what is behind them."""
    infrared: bool = False
    """The IR range sensor and the seven IR proximity sensors."""
    ir_range_m: Positive = 1.0
    proximity_range_m: Positive = 0.3
    inertial: bool = False
    """Gyro, accelerometer and wheel speeds."""
    microphones: bool = False
    hearing_range_m: Positive = 1.5
    jaw_reach_m: Positive = 0.18
    jaw_half_angle_rad: Angle = 0.5235987755982988
    encounter_range_m: Positive = 0.45
    encounter_half_angle_rad: Angle = 0.5235987755982988
    noise: Noise = msgspec.field(default_factory=Noise)
    observation_latency_steps: Steps = 0
    action_latency_steps: Steps = 0
    battery_drain_per_s: NotNegative = 0.0
    """How fast the body's own battery runs down; a captured pack charges it, too."""
