"""How a robot is wired is read from a file, and a wrong file is refused with the key that is wrong."""

from pathlib import Path

import pytest
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.firmata.board import DEFAULT_BOARD, load_board, shipped_boards

GOOD = """\
model = "mine"
track_m = 0.1
radius_m = 0.08
max_speed_m_s = 0.2
at_rest = "brake"
[left]
pwm = 5
ahead = 7
back = 8
[right]
pwm = 6
ahead = 9
back = 10
[proximity]
volts = [0.0, 5.0]
metres = [0.3, 0.0]
sensors = [{ analog = 0, column = 3, bearing_rad = 0.0 }, { analog = 1, column = 2, bearing_rad = 0.1 }]
[battery]
analog = 5
volts_per_volt = 2.0
empty_v = 6.0
full_v = 8.4
low_v = 6.5
"""
WRONG = [
    ("pwm = 5", "pwm = 128", r"\$\.left\.pwm"),
    ("pwm = 5", "pwn = 5", "pwn"),
    ("pwm = 5", "", r"missing required field `pwm` - at `\$\.left`"),
    ("pwm = 5", "pwm = 10", "`left` and `right`: a pin is used twice"),
    ("pwm = 5", "pwm = 1", "pins 0 and 1"),
    ("ahead = 7\nback = 8", "", r"`ahead` or `back` is missing - at `\$\.left`"),
    ("back = 8", "", '`at_rest`: "brake" needs both'),
    ('"brake"', '"drift"', r"\$\.at_rest"),
    ("max_speed_m_s = 0.2", "max_speed_m_s = 0", r"\$\.max_speed_m_s"),
    ("max_speed_m_s = 0.2", "max_speed_m_s = nan", r"\$\.max_speed_m_s"),
    ("[0.0, 5.0]", "[5.0, 0.0]", r"`volts` must rise .* at `\$\.proximity`"),
    ("[0.3, 0.0]", "[0.3]", "`metres` must be as many"),
    ("[0.3, 0.0]", "[0.0, 0.0]", "`metres` must not all be 0"),
    ("column = 2", "column = 3", "`sensors` must have different columns"),
    ("column = 2", "column = 7", r"\$\.proximity\.sensors\[1\]\.column"),
    ("analog = 1", "analog = 5", "`analog`: a channel is used twice"),
    ("full_v = 8.4", "full_v = 5.0", r"`full_v` must be above `empty_v` - at `\$\.battery`"),
    ('model = "mine"', "model = ", "line 1"),
    ('"mine"', '"\x00"', "mine.toml"),
]


@pytest.mark.parametrize("name", shipped_boards())
def test_a_board_of_the_package_is_right(name: str) -> None:
    """Every one; and nothing in it stops the wheels."""
    described = load_board(name).describe("uid", 0.05)
    assert described.watchdog == "none"
    assert described.watchdog_s == 0.0


def test_a_file_says_what_a_robot_is(tmp_path: Path) -> None:
    """All of it."""
    path = tmp_path / "mine.toml"
    path.write_text(GOOD)
    board = load_board(str(path))
    assert board.pins == (5, 7, 8, 6, 9, 10)
    assert board.channels == (0, 1, 5)
    robot = board.describe("me", 0.05)
    assert (robot.model, robot.uid, robot.track_m, robot.max_speed_m_s) == ("mine", "me", 0.1, 0.2)
    assert robot.proximity_bearings_rad == (0.0, 0.1)
    assert robot.proximity_range_m == 0.3
    assert (robot.battery_empty_v, robot.battery_full_v) == (6.0, 8.4)


@pytest.mark.parametrize(("right", "wrong", "said"), WRONG)
def test_a_wrong_file_is_refused_with_its_key(
    tmp_path: Path, right: str, wrong: str, said: str
) -> None:
    """In one line."""
    path = tmp_path / "mine.toml"
    assert right in GOOD
    path.write_text(GOOD.replace(right, wrong, 1))
    with pytest.raises(DeviceError, match=said) as error:
        load_board(str(path))
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    """And a name that is nearly one of a board is corrected."""
    with pytest.raises(DeviceError, match=r"none\.toml: No such file"):
        load_board(str(tmp_path / "none.toml"))
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(DeviceError, match=r"bytes\.toml: "):
        load_board(str(tmp_path / "bytes.toml"))
    with pytest.raises(DeviceError, match=f"did you mean {DEFAULT_BOARD}"):
        load_board("uno_motor_sheild")
