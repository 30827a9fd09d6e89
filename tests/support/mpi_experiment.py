"""The main module of an MPI run: the fake experiment, of which one condition waits for a file `go`.

As `crcolony/__main__.py` it runs whoever imports it: workers must not.
"""

import sys
from functools import partial
from pathlib import Path

from crcolony.experiments.framework.run_experiment import Request, run_experiment
from crcolony.experiments.pools.mpi_pool import mpi_processes
from tests.support.fake_experiment import REGISTRATION, fake_experiment, treated_wait

jobs, out = map(Path, sys.argv[1:3])
experiment = fake_experiment(partial(treated_wait, jobs))
request = Request(out=out, is_resumed="--resume" in sys.argv)
sys.exit(run_experiment(experiment, REGISTRATION, request, partial(mpi_processes, None)))
