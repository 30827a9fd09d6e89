"""Options of the commands whose use is recorded in an audit log."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.options import UsageError

if TYPE_CHECKING:
    from crcolony_deploy.audit_log import AuditLog

AUDIT = "CRCOLONY_AUDIT"
"""Environment variable with the file of the audit log."""
AUDIT_KEY = "CRCOLONY_AUDIT_KEY"
"""Environment variable with the file of the key that signs its records."""


def add_audit_log(parser: argparse.ArgumentParser) -> None:
    """Add the options for the audit log."""
    parser.add_argument(
        "--audit",
        type=Path,
        metavar="FILE",
        help=f"record this in an audit log; default: the environment variable {AUDIT}, or none",
    )
    parser.add_argument(
        "--audit-key",
        type=Path,
        metavar="FILE",
        help=f"secret key that signs the record (crcolony keygen); default: {AUDIT_KEY}",
    )


def audit_log_of(options: argparse.Namespace) -> "AuditLog | None":
    """Return the audit log of the options or the environment, None if there is none.

    Raises UsageError, IdentityError for its key, and AuditError if it cannot be written.
    """
    path = options.audit or (Path(os.environ[AUDIT]) if os.environ.get(AUDIT) else None)
    key = options.audit_key or (Path(os.environ[AUDIT_KEY]) if os.environ.get(AUDIT_KEY) else None)
    if path is None:
        if options.audit_key is not None:
            raise UsageError("--audit-key needs --audit")
        return None
    if key is None:
        raise UsageError(f"--audit {path}: needs --audit-key, which signs what is recorded")
    from crcolony_deploy.audit_log import AuditLog

    from crcolony.protocol.identity import load_key

    log = AuditLog(path, load_key(key))
    log.check_writable()
    return log
