"""Bytes of any kind do the firmware no harm and turn no wheel: a fuzzer with sanitizers says so, and is checked too."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.robot_firmware_bridge.firmware import FIRMWARE, build, needs_compiler

pytestmark = needs_compiler

SEEDS = range(1, 4)
ROUNDS = 2_000
SABOTAGE_ROUNDS = 4_000
"""A fault is found in the first few hundred inputs; this is how long it may hide."""

SABOTAGE = {
    "a decoder that takes bytes without end": (
        "core/frame.c",
        "if (decoder->used < sizeof decoder->buffer)",
        "if (1)",
    ),
    "a COBS decoder that reads past the frame": (
        "core/frame.c",
        "if (code == 0 || end > length)",
        "if (code == 0)",
    ),
    "a beacon's message that is longer than its memory": (
        "core/ir_carousel.c",
        "if (total > IR_MAX_MESSAGE || offset > total || length > total - offset)",
        "if (offset > total)",
    ),
    "frames whose CRC is not looked at": (
        "core/frame.c",
        "if (crc != frame_crc(data, length - 2u))",
        "if (crc == 0x5A5Au)",
    ),
    "commands that are too short": (
        "core/robot.c",
        "case MSG_COMMAND: return 15;",
        "case MSG_COMMAND: return 9;",
    ),
    "commands of another session": (
        "core/robot.c",
        "static void handle_command(struct robot *robot, const struct frame *request)\n{\n"
        "    const uint8_t *data = request->payload;\n"
        "    if (!robot->has_session || get_u32(data) != robot->session) {",
        "static void handle_command(struct robot *robot, const struct frame *request)\n{\n"
        "    const uint8_t *data = request->payload;\n"
        "    if (!robot->has_session) {",
    ),
    "commands that live as long as they say": (
        "core/robot.c",
        "ttl_ms > ROBOT_MAX_TTL_MS ? ROBOT_MAX_TTL_MS : ttl_ms",
        "ttl_ms",
    ),
    "commands after an emergency stop": (
        "core/robot.c",
        "    if (robot->is_stopped) {\n        refuse(robot, request, NAK_STOPPED);",
        "    if (robot->is_stopped == 9) {\n        refuse(robot, request, NAK_STOPPED);",
    ),
}


def fuzz(folder: Path, seed: int, rounds: int) -> "subprocess.CompletedProcess[str]":
    """Run the fuzzer that was built in a folder."""
    return subprocess.run(
        [str(folder / "fuzz_robot"), str(seed), str(rounds)], capture_output=True, text=True
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_the_fuzzer_finds_nothing(seed: int) -> None:
    """Neither a byte out of bounds nor a wheel that turns without a living command."""
    done = fuzz(build("fuzz"), seed, ROUNDS)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{ROUNDS} inputs\n"


@pytest.mark.parametrize("fault", SABOTAGE)
def test_the_fuzzer_finds_a_check_that_is_missing(fault: str, tmp_path: Path) -> None:
    """Of a firmware that lacks one."""
    file, check, without = SABOTAGE[fault]
    shutil.copytree(FIRMWARE, tmp_path / "firmware", ignore=shutil.ignore_patterns("build"))
    source = tmp_path / "firmware" / file
    text = source.read_text()
    assert text.count(check) == 1
    source.write_text(text.replace(check, without))
    # Without the optimizer it builds in half the time, and what is unused is no error here.
    made = subprocess.run(
        ["make", "-C", str(tmp_path / "firmware"), "fuzz", "OPTIMIZE=-O0", "WARNINGS=-std=c11"],
        capture_output=True,
        text=True,
    )
    assert made.returncode == 0, made.stderr
    assert fuzz(tmp_path / "firmware" / "build", 1, SABOTAGE_ROUNDS).returncode != 0
