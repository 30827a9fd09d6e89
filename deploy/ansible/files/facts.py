"""Prints, as JSON, what decides whether crcolony can be installed on this host. Runs with any Python 3.

The argument is the time (unix seconds) of the computer that asks.
"""

import json
import os
import platform
import sys
import time


def free_mb(path):
    while not os.path.exists(path):
        path = os.path.dirname(path)
    disk = os.statvfs(path)
    return disk.f_bavail * disk.f_frsize // 10**6


print(
    json.dumps(
        {
            "machine": platform.machine(),
            "python": ".".join(map(str, sys.version_info[:2])),
            "clock_offset_s": round(time.time() - float(sys.argv[1])),
            "free_mb": {path: free_mb(path) for path in ("/opt/crcolony", "/var/lib/crcolony")},
        }
    )
)
