"""Whether the control step is compiled for this processor."""

import platform
from collections.abc import Iterator
from pathlib import Path

import crcolony
from crcolony.compiled import is_switched_off, machine_digest, source_digest
from crcolony_deploy.doctor.finding import Finding, ok, warning
from crcolony_deploy.doctor.host_state import HostState


def check_compiled_code(host: HostState) -> Iterator[Finding]:
    """Look for code of these sources and this processor in the services' cache."""
    if is_switched_off():
        yield warning("NUMBA_DISABLE_JIT is set: everything runs 200 times slower", "unset it")
        return
    sources, machine = source_digest(Path(crcolony.__file__).parent), machine_digest()
    if list((host.cache_folder / f"{sources}-{machine}").glob("step-*.o")):
        yield ok(
            f"the control step is compiled for this processor ({platform.machine()}, {machine})"
        )
        return
    remedy = "wait for it, or run crcolony compile as the user crcolony"
    if list(host.cache_folder.glob(f"{sources}-*")):
        yield warning(
            f"the control step is compiled for another processor, not for this one ({machine})",
            remedy,
        )
    else:
        yield warning("the control step is not compiled yet: the first start takes minutes", remedy)
