"""`crcolony restore`: write a backup into a new folder, after checking all of it."""

import argparse
import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.audit_options import add_audit_log, audit_log_of
from crcolony.commands.options import add_examples
from crcolony.errors import EXIT_OK

if TYPE_CHECKING:
    from crcolony.storage.backup_manifest import BackedUpRobot


def add_restore(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony restore`."""
    parser.add_argument("archive", type=Path, metavar="FILE", help="what crcolony backup has made")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder, new or empty"
    )
    add_audit_log(parser)
    parser.set_defaults(command=_restore)
    add_examples(
        parser,
        (
            "crcolony restore robot.tar.gz --out runs/robot",
            "then, if the former copy is gone for good: crcolony robot --out runs/robot",
        ),
    )


def _restore(options: argparse.Namespace) -> int:
    from crcolony_deploy.audit_log import record_action

    from crcolony.shutdown import interrupted_once
    from crcolony.storage.restore import restore_backup

    log = audit_log_of(options)
    with interrupted_once():
        manifest = restore_backup(options.archive, options.out)
    ids = " ".join(robot.id[:8] for robot in manifest.robots)
    record_action(
        log, "restore", archive=options.archive, folder=options.out.absolute(), robots=ids
    )
    for robot in manifest.robots:
        print(_describe(robot, options.out))
    made = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(manifest.unix_s))
    print(f"{options.out}: {len(manifest.robots)} robots as of {made}, checked")
    print("two copies of one robot must never run: be sure that the former one is gone for good")
    print(
        "what a robot did after that time it no longer knows (docs/operate.md, Backup and restore)"
    )
    return EXIT_OK


def _describe(robot: "BackedUpRobot", folder: Path) -> str:
    line = f"robot {robot.id[:8]}: {robot.encounters} encounters, tick {robot.tick}"
    if not robot.has_key:
        key = shlex.quote(str(folder / robot.folder / "key"))
        line += f"; its key is not in the backup: put it at {key} before it starts"
    return line
