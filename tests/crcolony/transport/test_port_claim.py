"""Of several processes that are about to listen on a port, one has it."""

import subprocess
import sys

from crcolony.transport.port_claim import claim_port

PORT = 47_447
CLAIMS = f"""
from crcolony.transport.port_claim import claim_port
with claim_port({PORT}) as is_granted:
    print(is_granted, flush=True)
    input()
"""


def test_a_claim_is_granted_once_until_its_process_has_ended() -> None:
    """Also to this process, also after a kill; other ports are not affected."""
    with subprocess.Popen(
        [sys.executable, "-c", CLAIMS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "True\n"
        with claim_port(PORT) as is_granted, claim_port(PORT + 1) as is_next_granted:
            assert (is_granted, is_next_granted) == (False, True)
        other.kill()
        other.wait()
    for _ in range(2):
        with claim_port(PORT) as is_granted:
            assert is_granted
