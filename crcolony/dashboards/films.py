"""Films that are over: with the index that viewers seek by, and several times smaller."""

import subprocess
from pathlib import Path

from crcolony.dashboards.viewers import rerun_program

MOST_BYTES = 256 * 2**20
"""Of a film that is put in order while somebody waits"""
_PATIENCE_S = 600.0
_BEGINNING = b"RRF2"
"""Of every film; of anything else Rerun would make an empty one"""


def put_in_order(film: Path) -> None:
    """Rewrite a film with its index; where that fails it stays as it is, and can be seen all the same."""
    draft = film.with_name(film.name + ".draft")
    command = [str(rerun_program()), "rrd", "optimize", str(film), "-o", str(draft)]
    try:
        with film.open("rb") as file:
            if file.read(len(_BEGINNING)) != _BEGINNING:
                return
        done = subprocess.run(command, capture_output=True, timeout=_PATIENCE_S, check=False)
        if done.returncode == 0 and draft.is_file():
            draft.replace(film)
    except (OSError, subprocess.TimeoutExpired):
        return
    finally:
        draft.unlink(missing_ok=True)
