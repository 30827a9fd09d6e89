"""The system's Chromium without a screen, for tests that open a dashboard in a browser."""

import contextlib
import shutil
from collections.abc import Iterator
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Page, sync_playwright

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
_OPTIONS = [
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
"""It renders without a GPU, and makes no connections of its own"""
_TIMEOUT_MS = 90_000


@contextlib.contextmanager
def browser_at(address: str) -> Iterator[Page]:
    """A page that shows an address; the browser ends with the context."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=_OPTIONS)
        try:
            page = browser.new_page(viewport={"width": 1000, "height": 700})
            page.set_default_timeout(_TIMEOUT_MS)
            page.goto(f"{address}&renderer=webgl")
            yield page
        finally:
            browser.close()


def picture_of(page: Page) -> NDArray[np.uint8]:
    """Return a picture of the page, (rows, columns, 3)."""
    return np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB"))
