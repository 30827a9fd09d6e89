"""Makes files of this host be as they are wanted; prints, as JSON, which were not. Runs with any Python 3.

Standard input: {"files": {PATH: CONTENT}, "owned": [GLOB]}. What matches a glob and is not wanted is removed. What was
written stays noted until services were started with it, so that a playbook that fails in between is no loss.
"""

import glob
import json
import os
import sys


def content_of(path):
    try:
        with open(path) as file:
            return file.read()
    except OSError:
        return None


PENDING = "/etc/crcolony/pending.json"
wanted = json.load(sys.stdin)
written = {path for path, text in wanted["files"].items() if content_of(path) != text}
pending = sorted(written | set(json.loads(content_of(PENDING) or "[]")))
if written:
    with open(PENDING, "w") as file:
        json.dump(pending, file)
for path in written:
    os.makedirs(os.path.dirname(path), mode=0o755, exist_ok=True)
    draft = path + ".part"
    with open(draft, "w") as file:
        file.write(wanted["files"][path])
    os.chmod(draft, 0o644)
    os.rename(draft, path)
owned = {path for pattern in wanted["owned"] for path in glob.glob(pattern)}
removed = sorted(owned - set(wanted["files"]))
for path in removed:
    os.remove(path)
print(json.dumps({"written": sorted(written), "pending": pending, "removed": removed}))
