"""A panic of Zenoh's is noticed, and whatever is written to standard error still arrives."""

import os
import subprocess
import sys

from tests.support.paths import PYTHONPATH

PROGRAM = """
import contextlib, sys, time, zenoh
from crcolony.transport.panic_watch import PanicWatch

def waited(watch):
    until_s = time.monotonic() + 10
    while not (found := watch.take()) and time.monotonic() < until_s:
        time.sleep(0.01)
    return found

config = zenoh.Config()
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0?rel=2"]')
with PanicWatch() as watch:
    print("nothing special", file=sys.stderr, flush=True)
    with zenoh.open(zenoh.Config.from_json5('{scouting: {multicast: {enabled: false}}}')):
        print(watch.take())
    with contextlib.suppress(BaseException):
        zenoh.open(config)
    print(waited(watch), watch.take())
print("after it", file=sys.stderr)
raise SystemExit("the end")
"""


def test_a_panic_is_noticed_once() -> None:
    """A real one; all lines are passed on in their order, the last words of the process as well."""
    ran = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=os.environ | {"PYTHONPATH": PYTHONPATH}, capture_output=True, text=True,
        timeout=60.0, check=False,
    )  # fmt: skip
    assert ran.stdout.split() == ["False", "True", "False"], ran.stderr
    lines = ran.stderr.splitlines()
    assert lines[0] == "nothing special"
    assert any("panicked at" in line for line in lines)
    assert lines[-2:] == ["after it", "the end"]
    assert ran.returncode == 1
