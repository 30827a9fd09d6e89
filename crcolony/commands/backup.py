"""`crcolony backup`: copy robots' folders into one archive, while their robots run."""

import argparse
from pathlib import Path

from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK


def add_backup(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony backup`."""
    parser.add_argument(
        "folders",
        type=Path,
        nargs="+",
        metavar="FOLDER",
        help="a robot's folder, or one with robots' folders in it",
    )
    parser.add_argument(
        "--to",
        type=Path,
        required=True,
        metavar="FILE|DIR",
        help="a new .tar or .tar.gz; in a folder it is called by the time",
    )
    parser.add_argument(
        "--without-keys", action="store_true", help="leave the robots' secret keys out"
    )
    parser.add_argument(
        "--keep",
        type=int,
        metavar="N",
        help="in the folder of --to, delete all but the N newest archives that are called by the time",
    )
    parser.set_defaults(command=_backup)
    add_examples(
        parser,
        ("crcolony backup runs/robot --to robot.tar.gz", "one robot, whether it runs or not"),
        (
            "crcolony backup /var/lib/crcolony --to /mnt/backups --keep 7",
            "all robots of a host; every day, and a week of them stays",
        ),
    )


def _backup(options: argparse.Namespace) -> int:
    from crcolony.shutdown import interrupted_once
    from crcolony.storage.backup import delete_old_backups, make_backup

    if options.keep is not None and options.keep < 1:
        raise UsageError(f"--keep {options.keep}: must be at least 1")
    if options.keep is not None and not options.to.is_dir():
        raise UsageError(f"--keep needs a folder: --to {options.to} is none")
    with interrupted_once():
        archive, manifest = make_backup(options.folders, options.to, not options.without_keys)
    for robot in manifest.robots:
        print(
            f"robot {robot.id[:8]} in {robot.folder}: {robot.encounters} encounters, tick"
            f" {robot.tick}, {'with' if robot.has_key else 'without'} its key"
        )
    size_bytes = archive.stat().st_size
    print(f"{archive}: {len(manifest.robots)} robots, {size_bytes / 1e6:.1f} MB, checked")
    if options.keep is not None:
        for path in delete_old_backups(options.to, options.keep):
            print(f"{path}: deleted, --keep {options.keep}")
    if any(robot.has_key for robot in manifest.robots):
        print(
            "it holds secret keys: who can read it can be these robots; keep it as safe as they are"
        )
    return EXIT_OK
