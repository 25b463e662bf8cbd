"""Each lesson's widget works in a real JupyterLab: it is moved with the keyboard, and the picture changes."""

import json
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import nbformat
import pytest
from notebooks_under_test import PROJECT, execute

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]
TOKEN = "lessons"
QUIET = {"fetchNews": "false", "checkForUpdates": False}
RUN = """async ([place, id]) => {
  const app = window.jupyterapp, panel = app.shell.currentWidget;
  panel.content.activeCellIndex = place;
  await app.commands.execute('notebook:run-cell');
  return panel.content.widgets[place].model.toJSON().outputs.filter(output => output.output_type === 'error').length;
}"""
READY = """() => window.jupyterapp && window.jupyterapp.shell.currentWidget
  && window.jupyterapp.shell.currentWidget.content && window.jupyterapp.shell.currentWidget.content.widgets
  && window.jupyterapp.shell.currentWidget.content.widgets.length > 3
  && window.jupyterapp.shell.currentWidget.sessionContext.session
  && window.jupyterapp.shell.currentWidget.sessionContext.session.kernel
  && window.jupyterapp.shell.currentWidget.sessionContext.session.kernel.status === 'idle'"""


@pytest.fixture(scope="module")
def lab(tmp_path_factory) -> Iterator[str]:
    """A JupyterLab on a copy of the notebooks; its address."""
    home = tmp_path_factory.mktemp("lab")
    shutil.copytree(PROJECT / "notebooks", home / "notebooks", ignore=shutil.ignore_patterns(".ipynb_checkpoints"))
    settings = home / "settings" / "@jupyterlab" / "apputils-extension"
    settings.mkdir(parents=True)
    (settings / "notification.jupyterlab-settings").write_text(json.dumps(QUIET))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--expose-app-in-browser"]
    command += [f"--port={port}", f"--IdentityProvider.token={TOKEN}", f"--ServerApp.root_dir={home / 'notebooks'}"]
    environment = os.environ | {
        "JUPYTERLAB_SETTINGS_DIR": str(home / "settings"),
        "JUPYTER_CONFIG_DIR": str(home / "config"),
    }
    with (home / "log").open("wb") as log:
        server = subprocess.Popen(command, stdout=log, stderr=log, env=environment)
        address = f"http://127.0.0.1:{port}"
        try:
            wait_for(f"{address}/api?token={TOKEN}", server, home / "log")
            yield address
        finally:
            server.terminate()
            server.wait(30)


def wait_for(address: str, server: subprocess.Popen, log: Path) -> None:
    for _ in range(240):
        assert server.poll() is None, log.read_text()
        try:
            urllib.request.urlopen(address, timeout=5).close()
        except OSError:
            time.sleep(0.5)
        else:
            return
    raise TimeoutError(log.read_text())


def tagged(path: Path, *tags: str) -> list[tuple[int, str]]:
    """Return the places and ids of cells with one of the tags."""
    cells = nbformat.read(path, as_version=4).cells
    return [(i, cell.id) for i, cell in enumerate(cells) if set(tags) & set(cell.metadata.get("tags", []))]


@pytest.mark.parametrize("path", execute.LESSONS, ids=lambda path: path.stem)
def test_the_widget_of_a_lesson_follows_the_keyboard(lab, browser, screenshots, path):
    page = browser.new_page(viewport={"width": 1280, "height": 1400})
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    try:
        page.goto(f"{lab}/lab/tree/{path.name}?token={TOKEN}&reset")
        page.wait_for_function(READY, timeout=120_000)
        for place, id in tagged(path, "setup", "widget"):
            assert page.evaluate(RUN, [place, id]) == 0, f"cell {id} raised an error"
        place, _ = tagged(path, "widget")[0]
        shown = page.locator(".jp-Cell.jp-mod-active")
        outputs = shown.locator(".jp-OutputArea-output")
        outputs.locator("img").first.wait_for(timeout=60_000)
        before = outputs.locator("img").first.get_attribute("src")
        sliders = outputs.locator(".noUi-handle")
        others = outputs.locator("button, select, input[type=checkbox], input[type=radio]")
        control = sliders if sliders.count() else others
        control.first.focus()
        for key in ("ArrowRight", "Space", "ArrowDown"):
            page.keyboard.press(key)
            page.wait_for_timeout(1500)
            if outputs.locator("img").first.get_attribute("src") != before:
                break
        assert outputs.locator("img").first.get_attribute("src") != before
        page.screenshot(path=screenshots / f"lesson_{path.stem}.png")
        assert complaints == []
    finally:
        page.evaluate("() => window.jupyterapp && window.jupyterapp.shell.currentWidget.sessionContext.shutdown()")
        page.close()
