"""Answers the requests of a host, on the computer that has the authority: grants as JSON, for each folder one.

Arguments: the folder of the authority. Standard input: {FOLDER: REQUEST}.
"""

import json
import sys
from pathlib import Path

import msgspec
from crcolony_deploy.authority import Authority
from crcolony_deploy.membership_request import decode_request

from crcolony.errors import CrcolonyError

grants = {}
try:
    with Authority.opened(Path(sys.argv[1])) as authority:
        for folder, request in json.load(sys.stdin).items():
            grant = authority.admit(decode_request(request.encode()))
            grants[folder] = msgspec.json.encode(grant).decode()
except CrcolonyError as error:
    sys.exit(f"authority: {error}")
json.dump(grants, sys.stdout)
