"""Installs what the authority has granted to members on this host, by crcolony's Python. Input: {FOLDER: GRANT}."""

import json
import os
import pwd
import sys
from pathlib import Path

from crcolony_deploy.member_folder import install_grant
from crcolony_deploy.membership_request import decode_grant

user = pwd.getpwnam("crcolony")
os.setgroups([])
os.setgid(user.pw_gid)
os.setuid(user.pw_uid)
os.umask(0o077)
for folder, grant in json.load(sys.stdin).items():
    install_grant(Path(folder), decode_grant(grant.encode()))
