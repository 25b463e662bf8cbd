"""A real browser, headless: Debian's chromium, or whichever is installed."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
SCREENSHOTS = PROJECT / "build" / "screenshots"
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
HOW = "The browser tests need Chromium: on Debian and Ubuntu, apt-get install chromium; elsewhere, set STAIRLAB_CHROMIUM to its path."


@pytest.fixture(scope="session")
def chromium() -> str:
    """The path of the browser; tests are skipped where there is none, but not where STAIRLAB_BROWSER_TESTS asks for them."""
    path = os.environ.get("STAIRLAB_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if path:
        return path
    if os.environ.get("STAIRLAB_BROWSER_TESTS"):
        pytest.fail(HOW)
    pytest.skip(HOW)


@pytest.fixture(scope="session")
def browser(chromium) -> Iterator:
    """A running browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield running
        running.close()


@pytest.fixture(scope="session")
def screenshots() -> Path:
    """Where screenshots are kept."""
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    return SCREENSHOTS
