"""Asks for the certificates that members on this host need now, and prints the requests as JSON; by crcolony's Python.

Standard input: {"members": [{"role", "name", "key", "arenas", "folder"}], "at": HOST:PORT}. Keys are made here, for the
user crcolony, and never leave the host. Who has a certificate that is not due for renewal asks for nothing.
"""

import json
import os
import pwd
import sys
import time
from pathlib import Path

import msgspec
from crcolony_deploy.member_folder import (
    Applicant,
    request_membership,
    validity_in,
    write_enrollment,
)

from crcolony.errors import CrcolonyError
from crcolony.protocol.identity import create_key, load_key

STATE = Path("/var/lib/crcolony")


def is_due(folder: Path) -> bool:
    try:
        return time.time() >= validity_in(folder).renewal_unix_s
    except CrcolonyError:
        return True


given = json.load(sys.stdin)
user = pwd.getpwnam("crcolony")
STATE.mkdir(mode=0o755, exist_ok=True)
keys_of_robots = [Path(member["key"]) for member in given["members"] if member["key"]]
for folder in {STATE / "credentials", *(key.parent for key in keys_of_robots)}:
    if not folder.exists():
        folder.mkdir(mode=0o750)
        os.chown(folder, user.pw_uid, user.pw_gid)
os.setgroups([])
os.setgid(user.pw_gid)
os.setuid(user.pw_uid)
os.umask(0o077)
requests = {}
for member in given["members"]:
    folder = Path(member["folder"])
    if not is_due(folder):
        continue
    keys = [Path(member["key"])] if member["key"] else []
    robots = tuple(load_key(key) if key.exists() else create_key(key) for key in keys)
    applicant = Applicant(member["role"], member["name"], robots, tuple(member["arenas"]))
    requests[str(folder)] = msgspec.json.encode(request_membership(folder, applicant)).decode()
    write_enrollment(folder, given["at"], keys, member["arenas"])
json.dump(requests, sys.stdout)
