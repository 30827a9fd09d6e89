"""The messages of ROS 2 that a base needs, field by field as their packages define them."""

from dataclasses import dataclass, field

from crcolony_bridge.ros2.cdr import (
    Bool,
    Covariance,
    Float32,
    Float32Sequence,
    Float64,
    Int32,
    UInt8,
    UInt32,
)

NO_COVARIANCE = (0.0,) * 36


@dataclass(frozen=True)
class Time:
    """builtin_interfaces/Time."""

    sec: Int32 = 0
    nanosec: UInt32 = 0


@dataclass(frozen=True)
class Header:
    """std_msgs/Header."""

    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass(frozen=True)
class Vector3:
    """geometry_msgs/Vector3, and geometry_msgs/Point."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


@dataclass(frozen=True)
class Quaternion:
    """geometry_msgs/Quaternion."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0
    w: Float64 = 1.0


@dataclass(frozen=True)
class Twist:
    """geometry_msgs/Twist: speed ahead is `linear.x`, turning rate `angular.z`, left is positive."""

    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass(frozen=True)
class TwistStamped:
    """geometry_msgs/TwistStamped."""

    header: Header = field(default_factory=Header)
    twist: Twist = field(default_factory=Twist)


@dataclass(frozen=True)
class Pose:
    """geometry_msgs/Pose."""

    position: Vector3 = field(default_factory=Vector3)
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass(frozen=True)
class PoseWithCovariance:
    """geometry_msgs/PoseWithCovariance."""

    pose: Pose = field(default_factory=Pose)
    covariance: Covariance = NO_COVARIANCE


@dataclass(frozen=True)
class TwistWithCovariance:
    """geometry_msgs/TwistWithCovariance."""

    twist: Twist = field(default_factory=Twist)
    covariance: Covariance = NO_COVARIANCE


@dataclass(frozen=True)
class Odometry:
    """nav_msgs/Odometry."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@dataclass(frozen=True)
class BatteryState:
    """sensor_msgs/BatteryState: V, °C, A, Ah; `percentage` from 0 to 1; NaN is not measured."""

    header: Header = field(default_factory=Header)
    voltage: Float32 = 0.0
    temperature: Float32 = 0.0
    current: Float32 = 0.0
    charge: Float32 = 0.0
    capacity: Float32 = 0.0
    design_capacity: Float32 = 0.0
    percentage: Float32 = 0.0
    power_supply_status: UInt8 = 0
    power_supply_health: UInt8 = 0
    power_supply_technology: UInt8 = 0
    present: Bool = False
    cell_voltage: Float32Sequence = ()
    cell_temperature: Float32Sequence = ()
    location: str = ""
    serial_number: str = ""


@dataclass(frozen=True)
class LaserScan:
    """sensor_msgs/LaserScan: rad, s and m; infinite where there is nothing."""

    header: Header = field(default_factory=Header)
    angle_min: Float32 = 0.0
    angle_max: Float32 = 0.0
    angle_increment: Float32 = 0.0
    time_increment: Float32 = 0.0
    scan_time: Float32 = 0.0
    range_min: Float32 = 0.0
    range_max: Float32 = 0.0
    ranges: Float32Sequence = ()
    intensities: Float32Sequence = ()


@dataclass(frozen=True)
class Range:
    """sensor_msgs/Range: rad and m; infinite where there is nothing."""

    header: Header = field(default_factory=Header)
    radiation_type: UInt8 = 0
    field_of_view: Float32 = 0.0
    min_range: Float32 = 0.0
    max_range: Float32 = 0.0
    range: Float32 = 0.0
    variance: Float32 = 0.0
