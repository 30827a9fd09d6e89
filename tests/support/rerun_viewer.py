"""Rerun's native viewer without a screen, for tests that take pictures of a dashboard."""

import contextlib
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from crcolony_dashboards.viewers import rerun_program
from numpy.typing import NDArray
from PIL import Image

from crcolony.transport.zenoh_session import free_port
from tests.support.process import Process, wait_until

Picture = NDArray[np.uint8]
"""(rows, columns, 3)"""


class HeadlessViewer:
    """A viewer that is connected to a dashboard."""

    def __init__(self, client: Any, process: Process) -> None:
        self.client, self.process = client, process

    def view(self, name: str) -> Any:
        """Return the view whose name starts with `name`."""
        return next(view for view in self.client.get_state().views if view.name.startswith(name))

    @property
    def names(self) -> list[str]:
        """The names of all views."""
        return [view.name for view in self.client.get_state().views]

    def reports(self) -> list[str]:
        """Return the errors and warnings of all views."""
        state = self.client.get_state()
        return [f"{view.name}: {report}" for view in state.views for report in view.reports]

    def until_s(self, timeline: str) -> float:
        """Return the end of a timeline (s); minus infinity if nothing is on it."""
        recordings = self.client.get_state().recordings
        found = [line for one in recordings for line in one.timelines if line.name == timeline]
        return max((line.end / 1e9 for line in found), default=-float("inf"))

    def freeze(self, unix_s: float) -> None:
        """Stop at a time of the wall clock, and show what was drawn up to it."""
        self.client.set_time("wall", timestamp=unix_s, play_state="paused")

    def turn_to(self, tab: int) -> None:
        """Show the n-th tab."""
        blueprint = self.client.get_blueprint().blueprint
        tabs = next(
            container["ContainerBlueprint"]
            for container in blueprint.values()
            if container.get("ContainerBlueprint", {}).get("container_kind") == "Tabs"
        )
        tabs["active_tab"] = tabs["contents"][tab]
        self.client.set_blueprint(blueprint, of="recording")

    def picture(self, name: str) -> Picture:
        """Return a picture of a view, once two successive ones are equal."""
        view_id = self.view(name).view_id
        return _settled(lambda: self.client.take_screenshot(view_id))

    def whole_picture(self) -> Picture:
        """Return a picture of the whole window, parts of which change all the time."""
        return decode(self.client.take_screenshot())

    def entities(self) -> set[str]:
        """Return the paths of all entities."""
        schema = self.client.get_recording_schema(paths_only=True)
        return {entity.entity_path for entity in schema.entities}


def headless_viewer(
    url: str, log: Path, is_shown: bool = True
) -> contextlib.AbstractContextManager[HeadlessViewer]:
    """A viewer of the dashboard at `url`, which ends with the context; if `is_shown`, it has received the layout."""
    return _viewer(["--connect", url], log, is_shown)


def headless_viewer_of(rrd: Path, log: Path) -> contextlib.AbstractContextManager[HeadlessViewer]:
    """A viewer of a recording, which ends with the context."""
    return _viewer([str(rrd)], log, True)


@contextlib.contextmanager
def _viewer(arguments: list[str], log: Path, is_shown: bool) -> Iterator[HeadlessViewer]:
    from rerun.experimental import ViewerClient

    port = free_port()
    command = [str(rerun_program()), "--headless", *arguments, "--bind", "127.0.0.1"]
    process = Process([*command, "--port", str(port), "--memory-limit", "2GB"], log)
    process.start()
    try:
        client: Any = None

        def is_ready() -> bool:
            nonlocal client
            assert process.is_running, log.read_text()
            try:
                client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
                return bool(client.get_state().views) or not is_shown
            except (RuntimeError, ConnectionError, OSError, ValueError):
                return False

        wait_until(is_ready, "the viewer shows a dashboard")
        yield HeadlessViewer(client, process)
    finally:
        process.kill()


def _settled(take_screenshot: Callable[[], bytes]) -> Picture:
    before = decode(take_screenshot())
    for _ in range(40):
        now = decode(take_screenshot())
        if now.shape == before.shape and np.array_equal(now, before):
            return now
        before = now
    raise AssertionError("no two successive pictures are equal")


def decode(png: bytes) -> Picture:
    """Return the pixels of a PNG file."""
    return np.asarray(Image.open(BytesIO(png)).convert("RGB"))
