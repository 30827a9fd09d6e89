"""`python -m crcolony` is the command `crcolony`."""

import os
import sys

# `python -m` looks for modules in the working folder first, and a user's `queue.py` is none; a checkout is ours.
if not sys.flags.safe_path and sys.path[0] != os.path.dirname(os.path.dirname(__file__)):
    del sys.path[0]

from crcolony.cli import main

sys.exit(main())
