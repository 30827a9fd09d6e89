"""The options of commands whose robots can begin with those of an earlier run, and the config they then start from."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.options import UsageError

if TYPE_CHECKING:
    from crcolony.config import Config
    from crcolony.results.earlier_run import EarlierRun
    from crcolony.storage.folder_record import Maker
    from crcolony.storage.founders_file import Beginning


def add_from(parser: argparse.ArgumentParser) -> None:
    """Add the options that name an earlier run."""
    parser.add_argument(
        "--from",
        type=Path,
        metavar="RUN",
        dest="from_run",
        help="begin with the robots of this run, newborn: the folder of an evolve, a launch or a host",
    )
    parser.add_argument(
        "--generation",
        type=int,
        metavar="G",
        help="with --from: their generation; default: the newest of each robot",
    )


class Start:
    """What a command starts from: a folder in which it goes on, an earlier run, or nothing.

    Raises UsageError, EarlierRunError, FolderError or StorageError. An earlier run is not read when the command goes
    on in a folder whose robots began with it: it may be gone by now.
    """

    def __init__(self, options: argparse.Namespace, maker: "Maker") -> None:
        self.folder = _folder_to_go_on_in(options.out, maker)
        """None: the command starts anew"""
        self.earlier: EarlierRun | None = None
        run = options.from_run
        if run is None:
            if options.generation is not None:
                raise UsageError("--generation needs --from, the folder of a run")
        elif self.folder is not None:
            _check_origin(self.folder, run, options.generation)
        else:
            from crcolony.results.earlier_run import read_earlier_run

            self.earlier = read_earlier_run(run, options.generation)

    def config_file(self, options: argparse.Namespace) -> Path | None:
        """Return the config that settings of the command line change; None: the built-in one."""
        if options.config is not None:
            return Path(options.config)
        if self.folder is not None:
            from crcolony.config import CONFIG_FILE

            path = self.folder / CONFIG_FILE
            return path if path.is_file() else None
        return self.earlier.config_file if self.earlier is not None else None

    def robots(self, usual: int) -> int:
        """Return how many robots to start if no option says so: as many as there were, or the usual number."""
        if self.folder is not None:
            return len(list((self.folder / "robots").glob("*"))) or usual
        return len(self.earlier.subpopulations) if self.earlier is not None else usual

    def beginning(self, config: "Config", robots: int) -> "Beginning | None":
        """Return what so many robots begin with, and print it; None: random genotypes."""
        if self.earlier is None:
            return None
        beginning = self.earlier.beginning(config)
        print(self.earlier.describe(robots, config.life.agents), flush=True)
        return beginning


def _folder_to_go_on_in(folder: Path | None, maker: "Maker") -> Path | None:
    """Return --out if the same command made it before; raises FolderError if another one did.

    An in-process run goes on with --resume only, and the key alone is no robot yet.
    """
    from crcolony.storage.claimed_folder import check_folder
    from crcolony.storage.files import ROBOT_FILE, existing_robot_file
    from crcolony.storage.folder_record import maker_of, read_record

    if folder is None:
        return None
    check_folder(folder, maker)
    if maker == "evolve" or maker_of(folder) != maker:
        return None
    is_robot = existing_robot_file(folder / ROBOT_FILE).exists() or read_record(folder) is not None
    return folder if maker != "robot" or is_robot else None


def _check_origin(folder: Path, run: Path, generation: int | None) -> None:
    """Raise UsageError if the robots of a folder did not begin with those of this run."""
    from crcolony.storage.folder_record import read_record

    record = read_record(folder)
    origin = record.origin if record is not None else None
    if origin is None:
        raise UsageError(f"--from {run}: the robots in {folder} did not begin with those of a run")
    if Path(origin.run) != run.resolve() or generation not in (None, origin.generation):
        raise UsageError(
            f"--from {run}: the robots in {folder} began with generation {origin.generation}"
            f" of {origin.run}"
        )
