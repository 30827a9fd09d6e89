"""A robot's link on one machine without a machine: its page, and the other end's hands on it."""

from crcolony.body.shared_pages import NOTHING, PAGE_BYTES, Page
from crcolony.compiled import FloatArray
from crcolony.protocol.identity import RobotId
from crcolony.protocol.link_keys import LinkKeys
from crcolony.transport.shared_rows import RowPage


class PageLink:
    """A `LinkOnThisMachine` that is open from the first grant of a body until a test closes it."""

    def __init__(self) -> None:
        self.rows = RowPage(memoryview(bytearray(PAGE_BYTES)))
        self.rows.clear()
        self.is_open = False
        self.rings = 0

    @property
    def page(self) -> Page | None:
        return self.rows.arrays if self.is_open else None

    def open(self, robot: RobotId, arena_run: int, keys: LinkKeys) -> None:
        self.is_open = True

    def ring(self) -> None:
        self.rings += 1

    def publish_action(self, tick: int, row: FloatArray) -> None:
        self.rows.write_action(tick, row)
        self.ring()

    @property
    def acted(self) -> tuple[int, bytes]:
        """Tick and row of the latest action."""
        action = self.rows.read_action(NOTHING)
        return (action[0], action[1].tobytes()) if action else (NOTHING, b"")
