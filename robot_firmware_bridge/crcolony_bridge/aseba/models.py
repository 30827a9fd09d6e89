"""The robots that run Aseba, as data: their variables, their geometry, and what their raw values mean.

Lengths and speeds are those of the simulated robots, near those of the real ones. No physical robot has been measured.
"""

from dataclasses import dataclass
from math import pi, radians

from crcolony.body import contract

AHEAD = 3
"""Column of the proximity sensor ahead."""


@dataclass(frozen=True)
class Proximity:
    """Infrared proximity sensors."""

    variable: str
    sensors: int
    columns: tuple[tuple[int, ...], ...]
    """For every column of an observation the sensors whose nearest distance it is; none where the robot is blind"""
    bearings_rad: tuple[float, ...]
    """Of every column; of a blind one, where a sensor would be"""
    curve_raw: tuple[float, ...]
    """Rising raw values, and in `curve_m` the distances from the hull that they mean"""
    curve_m: tuple[float, ...]

    @property
    def range_m(self) -> float:
        """How far the sensors measure."""
        return self.curve_m[0]


@dataclass(frozen=True)
class ColourRule:
    """What a patch of pixels is in which one colour outshines the others."""

    colour: int
    """0 red, 1 green, 2 blue"""
    blob: int
    """The observation's first column of what it is"""
    width_m: float
    """How wide such a thing is: from this and its width in pixels comes its distance"""


@dataclass(frozen=True)
class Camera:
    """A line of pixels, from right to left."""

    variables: tuple[str, str, str]
    pixels: int
    half_angle_rad: float
    ahead_m: float
    """How far before the robot's middle it is"""
    full: int
    """The value of full brightness"""
    rules: tuple[ColourRule, ...]


@dataclass(frozen=True)
class Lamp:
    """A lamp of three colours: three variables, or a native function that takes them."""

    full: int
    variables: tuple[str, ...] = ()
    native: str = ""


@dataclass(frozen=True)
class IrWords:
    """Infrared that carries one word at a time, by variables, an event and a native function of the robot."""

    sent: str
    """What it repeats; a negative number is nothing"""
    received: str
    event: str
    """That a word was received"""
    enable: str
    """The native function that switches it on"""
    known_by: str
    """A variable that only robots have whose infrared works: simulators have the others without effect"""


@dataclass(frozen=True)
class EnergyVariable:
    """Energy that is no voltage: the simulated battery of a body."""

    variable: str
    full: float
    low: float


@dataclass(frozen=True)
class AsebaModel:
    """One kind of robot. Optional variables are used where the robot has them."""

    name: str
    node_name: str
    """What the name of its node begins with"""
    uid: str
    """What its uid begins with; the number of its node follows"""
    motors: tuple[str, str]
    speeds: tuple[str, str]
    """Variables of the wheels as measured, or as set where nothing is measured"""
    units_per_m_s: float
    max_speed_m_s: float
    track_m: float
    radius_m: float
    tick_event: str
    reading_event: str
    proximity: Proximity
    lamp: Lamp
    camera: Camera | None = None
    energy: EnergyVariable | None = None
    ir_words: IrWords | None = None


E_PUCK = AsebaModel(
    name="e-puck (Aseba)",
    node_name="e-puck",
    uid="e-puck",
    motors=("speed.left", "speed.right"),
    speeds=("speed.left", "speed.right"),
    units_per_m_s=1000 / 0.128,
    max_speed_m_s=0.128,
    track_m=0.051,
    radius_m=0.037,
    tick_event="ir_sensors",
    reading_event="ir_sensors",
    proximity=Proximity(
        "prox",
        sensors=8,  # from the right of ahead clockwise; 3 and 4 look back, and no column does
        columns=((2,), (1,), (0,), (0, 7), (7,), (6,), (5,)),
        bearings_rad=(-pi / 2, -pi / 4, -radians(16), 0.0, radians(16), pi / 4, pi / 2),
        # Where there is nothing, noise of up to 20 is left.
        curve_raw=(50, 87, 131, 170, 225, 310, 448, 717, 1250, 2347, 3499, 3700),
        curve_m=(0.06, 0.05, 0.04, 0.035, 0.03, 0.025, 0.02, 0.015, 0.01, 0.005, 0.001, 0.0),
    ),
    lamp=Lamp(100, variables=("color.red", "color.green", "color.blue")),
    camera=Camera(
        ("cam.red", "cam.green", "cam.blue"),
        pixels=60,
        half_angle_rad=pi / 6,
        ahead_m=0.037,
        full=100,
        # Feeders that charge are green; another e-puck has the colour of its lamp all around, so that its tail is
        # not told from its face: red is a face.
        rules=(
            ColourRule(0, contract.FACE, 0.074),
            ColourRule(1, contract.PACK, 0.032),
            ColourRule(2, contract.PACK, 0.032),
        ),
    ),
    energy=EnergyVariable("energy", full=20.0, low=3.0),  # begins with 10, and a feeder has 10 more
)

THYMIO = AsebaModel(
    name="Thymio II",
    node_name="thymio-II",
    uid="thymio",
    motors=("motor.left.target", "motor.right.target"),
    speeds=("motor.left.speed", "motor.right.speed"),
    units_per_m_s=500 / 0.166,
    max_speed_m_s=0.166,
    track_m=0.094,
    radius_m=0.08,
    tick_event="motor",
    reading_event="prox",
    proximity=Proximity(
        "prox.horizontal",
        sensors=7,  # from left to right; 5 and 6 look back, and no column does
        columns=((), (4,), (3,), (2,), (1,), (0,), ()),
        bearings_rad=(-pi / 2, *(radians(b) for b in (-40, -20, 0, 20, 40)), pi / 2),
        # Beyond its range it is 0.
        curve_raw=(1244, 1358, 1512, 1690, 1896, 2133, 2392, 3012, 3689, 4266, 4439, 4505),
        curve_m=(0.14, 0.13, 0.12, 0.11, 0.1, 0.09, 0.08, 0.06, 0.04, 0.02, 0.01, 0.0),
    ),
    lamp=Lamp(32, native="leds.top"),
    # By the sources of its firmware: values of 0 to 2,056 are emitted ten times a second, a negative one is not. Its
    # makers say that a bit of the eleven might once be needed for something else.
    ir_words=IrWords(
        "prox.comm.tx",
        "prox.comm.rx",
        "prox.comm",
        "prox.comm.enable",
        known_by="prox.comm.rx._payloads",
    ),
    # Real ones have `_vbat`, in units of their converter that nobody has measured for us: no battery is better than a
    # wrong one, by which a robot would be stopped.
)

MODELS = (E_PUCK, THYMIO)


def find_model(node_name: str) -> AsebaModel | None:
    """Return the model of a node by its name, None if it is not known."""
    return next((model for model in MODELS if node_name.startswith(model.node_name)), None)
