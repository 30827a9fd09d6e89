"""Folders of robots for tests of backups: with a key, a file with some encounters, and what else a robot has."""

import tarfile
from pathlib import Path

from crcolony.protocol.identity import Identity, create_key
from crcolony.storage.store import RobotStore
from tests.support.robot_stores import SCHEMA, events, mate, robot


def make_robot(folder: Path, encounters: int = 3) -> Identity:
    """Make the folder of a robot that is stopped."""
    folder.mkdir(parents=True)
    identity = create_key(folder / "key")
    store = open_robot(folder, identity)
    store.begin_incarnation(1000)
    for number in range(1, encounters + 1):
        mate(store, number)
    store.save(robot(1), events(1), tick=77)
    store.close()
    (folder / "made_by.toml").write_text('made_by = "robot"\n')
    return identity


def open_robot(folder: Path, identity: Identity) -> RobotStore:
    """Open a robot's file, as its process does."""
    return RobotStore(folder / "robot.sqlite", identity.id, SCHEMA, durable=False)


def repack(
    archive: Path, target: Path, *changes: tuple[str, tarfile.TarInfo | None, bytes]
) -> Path:
    """Write an archive again; return its path.

    Of each change the file of this name gets another header (None: is left out) and content, or is added at the end.
    """
    import io

    todo = {name: (header, content) for name, header, content in changes}
    with tarfile.open(archive) as old, tarfile.open(target, "w") as new:
        for member in old:
            data = old.extractfile(member)
            assert data is not None
            header, content = todo.pop(member.name, (member, data.read()))
            if header is not None:
                header.size = len(content) if header.isreg() else 0
                new.addfile(header, io.BytesIO(content))
        for header, content in todo.values():
            if header is not None:
                header.size = len(content) if header.isreg() else 0
                new.addfile(header, io.BytesIO(content))
    return target
