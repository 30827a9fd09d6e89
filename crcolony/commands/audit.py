"""`crcolony audit`: check the audit log of what operators did, and print it."""

import argparse
import re
import shlex
from pathlib import Path

from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK, EXIT_VIOLATED


def add_audit(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony audit`."""
    parser.add_argument(
        "action", choices=("verify", "show"), help="verify the chain and signatures, or print it"
    )
    parser.add_argument(
        "file", type=Path, metavar="FILE", help="the log; its earlier parts are beside it"
    )
    parser.add_argument(
        "--by",
        action="append",
        default=[],
        metavar="ID",
        help="id of a key that may sign, as crcolony keygen prints it; may be repeated; default: any",
    )
    parser.add_argument(
        "--contains",
        metavar="DIGEST",
        help="a digest that an earlier verify has printed: the end up to there was not cut off",
    )
    parser.add_argument(
        "--last", type=int, metavar="N", help="show the last N records; default: all"
    )
    parser.set_defaults(command=_audit)
    add_examples(
        parser,
        ("crcolony audit show audit.jsonl --last 20", "who did what"),
        (
            "crcolony audit verify audit.jsonl --by 1f0c… --contains 9a31…",
            "nothing was changed, removed or put in, nor cut off since that digest was noted",
        ),
    )


def _audit(options: argparse.Namespace) -> int:
    from crcolony_deploy.audit_verification import verify_audit_log

    if any(not re.fullmatch("[0-9a-f]{32}", text) for text in options.by):
        raise UsageError(f"--by {' '.join(options.by)}: expected ids of 32 hex digits")
    if options.contains is not None and not re.fullmatch("[0-9a-f]{16,64}", options.contains):
        raise UsageError(f"--contains {options.contains}: expected 16 to 64 hex digits")
    if options.last is not None and options.last < 1:
        raise UsageError(f"--last {options.last}: must be at least 1")
    report = verify_audit_log(options.file, options.by or None)
    if options.contains and not any(d.startswith(options.contains) for d in report.digests):
        report.findings.append(f"no record has digest {options.contains}: the end was cut off")
    if options.action == "show":
        for record in report.records[-(options.last or len(report.records)) :]:
            details = " ".join(f"{k}={shlex.quote(v)}" for k, v in record.details.items())
            print(f"{record.seq} {record.time} {record.who}: {record.action} {details}".rstrip())
    for finding in report.findings:
        print(f"NOT IN ORDER: {finding}")
    if options.action == "verify" and not report.findings:
        first, last = report.records[0], report.records[-1]
        print(f"records {first.seq} to {last.seq} are in order, the last of {last.time}")
        known = "as they should be" if options.by else "any key was accepted: --by ID"
        print(f"signed by {', '.join(report.signers)} ({known})")
        print(f"digest of the last, to be noted elsewhere: {report.digests[-1]}")
    return EXIT_VIOLATED if report.findings else EXIT_OK
