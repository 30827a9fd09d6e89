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
    """Of the distance of what the camera sees."""
    bearing_rad: NotNegative = 0.0
    """Of the bearing of what the camera sees."""
    proximity_m: NotNegative = 0.0
    """Of the infrared sensors' distances."""
    gyro_rad_s: NotNegative = 0.0
    """Of the gyro's turning rate."""
    acceleration_m_s2: NotNegative = 0.0
    """Of the accelerometer."""
    wheel_m_s: NotNegative = 0.0
    """Of the wheels' speeds."""


class CyberRodent(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The body of thesis 4.6: 22 cm, 1.75 kg, two wheels, at most 1.3 m/s. A sense that is off
    costs no time."""

    radius_m: Positive = 0.11
    """Radius of the round body."""
    mass_kg: Positive = 1.75
    """Mass of the body."""
    track_m: Positive = 0.16
    """Distance between the wheels."""
    camera: bool = True
    """Whether there is a camera: it sees battery packs, faces and tail lamps."""
    camera_range_m: Positive = 1.5
    """How far the camera sees."""
    camera_half_angle_rad: Angle = 1.3089969389957472
    """How far to either side the camera sees."""
    occlusion: bool = True
    """Bodies, pillars and inner walls hide what is behind them."""
    infrared: bool = False
    """Whether there are the IR range sensor and the seven IR proximity sensors."""
    ir_range_m: Positive = 1.0
    """How far the IR range sensor measures."""
    proximity_range_m: Positive = 0.3
    """How far the IR proximity sensors measure."""
    inertial: bool = False
    """Whether there are gyro, accelerometer and wheel speeds."""
    microphones: bool = False
    """Whether there are microphones."""
    hearing_range_m: Positive = 1.5
    """How far the microphones reach."""
    jaw_reach_m: Positive = 0.18
    """How far from the body's middle the jaw captures a battery pack."""
    jaw_half_angle_rad: Angle = 0.5235987755982988
    """How far to either side of straight ahead the jaw captures."""
    encounter_range_m: Positive = 0.45
    """How near two robots must be to mate, middle to middle."""
    encounter_half_angle_rad: Angle = 0.5235987755982988
    """How directly each must face the other to mate."""
    noise: Noise = msgspec.field(default_factory=Noise)
    observation_latency_steps: Steps = 0
    """Control steps by which observations are late."""
    action_latency_steps: Steps = 0
    """Control steps by which actions are late."""
    battery_drain_per_s: NotNegative = 0.0
    """How fast the body's own battery runs down; a captured pack charges it, too."""
