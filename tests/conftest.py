"""The first call of a compiled function compiles it, which no deadline for one example allows.

Examples are the same on every run; `--hypothesis-profile=explore` looks at new ones.
"""

import os
import signal
import tempfile

import numba
import numpy as np
from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("repeatable")

# Under nohup, and behind a shell's &, signals stay ignored, also in the processes that tests start; tests close
# terminals and press Ctrl-C.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)

# Arenas without a folder keep their keys in one of the user's.
_STATE = tempfile.TemporaryDirectory(prefix="crcolony-state-")
os.environ["XDG_STATE_HOME"] = _STATE.name

if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
    # Compiled arithmetic overflows and divides in silence; so must the same code run as plain Python.
    np.seterr(all="ignore")
