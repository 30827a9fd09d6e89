"""`python -m crcolony` is the command `crcolony`."""

import sys

from crcolony.cli import main

sys.exit(main())
