"""Prints, as JSON, what decides whether crcolony can be installed on this host. Runs with any Python 3."""

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
            "python": "%d.%d" % sys.version_info[:2],
            "unix_s": time.time(),
            "free_mb": {path: free_mb(path) for path in ("/opt/crcolony", "/var/lib/crcolony")},
        }
    )
)
