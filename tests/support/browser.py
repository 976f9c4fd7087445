"""A real browser for tests of pages: what a reader sees at a width, on light or dark."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
MISSING = "no Chromium or Chrome starts: apt-get install chromium, and pip install playwright"


@contextmanager
def browser() -> Iterator[Any]:
    """Start Chromium or Chrome.  Where there is none a build server fails, and any other machine skips the test."""
    from playwright.sync_api import Error, sync_playwright

    program = next((path for name in NAMES if (path := shutil.which(name))), None)
    with sync_playwright() as playwright:
        try:
            # tests run as root on build servers, where Chromium has no sandbox
            started = playwright.chromium.launch(
                executable_path=program, channel=None if program else "chrome", args=["--no-sandbox"]
            )
        except Error:
            if os.environ.get("CI"):
                raise
            pytest.skip(MISSING)
        try:
            yield started
        finally:
            started.close()


def shown(started: Any, file: Path, width: int, look: str) -> Any:
    """Open a page ``width`` pixels wide on a ``light`` or ``dark`` screen, with all that is folded unfolded."""
    context = started.new_context(viewport={"width": width, "height": 844}, color_scheme=look)
    page = context.new_page()
    page.goto(file.as_uri())
    page.evaluate("for (const details of document.querySelectorAll('details')) details.open = true")
    return page
