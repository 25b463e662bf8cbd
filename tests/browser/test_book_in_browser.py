"""The web book in a real browser: no request leaves the site, nothing complains, and what has a slider reacts."""

import functools
import threading
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]
WIDTHS = (1280, 390)
NEXT_FRAME = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
EQUATION_ERRORS = "found => found.map(e => e.getAttribute('data-mjx-error') ?? 'a macro that is not known')"
CUT_EQUATIONS = (
    "[...document.querySelectorAll('mjx-container[display=true]')].filter(e => e.scrollWidth > e.clientWidth).length"
)


class Quiet(SimpleHTTPRequestHandler):
    """A server that does not write about each request."""

    def log_message(self, *_) -> None:
        """Say nothing."""


@pytest.fixture(scope="module")
def address(site) -> Iterator[str]:
    """Where the site is served: in a sub-path of a server."""
    with ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site.parent)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/{site.name}"
        server.shutdown()


def pages(site: Path) -> list[str]:
    return sorted(str(path.relative_to(site)) for path in site.rglob("*.html") if "_static" not in path.parts)


def lessons(site: Path) -> list[str]:
    return [str(path.relative_to(site)) for path in sorted((site / "made" / "course").glob("[0-9]*.html"))]


def listen(page) -> tuple[list[str], list[str]]:
    """Return what the page will ask for, and what it will complain about."""
    asked: list[str] = []
    complaints: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    return asked, complaints


def test_no_page_asks_another_host_or_complains_and_page_and_equations_fit_the_window(site, address, browser):
    view = browser.new_page()
    asked, complaints = listen(view)
    wide = []
    for name in pages(site):
        view.goto(f"{address}/{name}", wait_until="networkidle")
        view.evaluate("window.MathJax?.startup?.promise")
        errors = view.locator("[data-mjx-error], mjx-container [fill=red]").evaluate_all(EQUATION_ERRORS)
        complaints += [f"{name}: {error}" for error in errors]
        for width in WIDTHS:
            view.set_viewport_size({"width": width, "height": 900})
            view.evaluate(NEXT_FRAME)
            if view.evaluate(CUT_EQUATIONS):
                wide.append(f"an equation of {name} at {width} pixels")
            if view.evaluate("document.documentElement.scrollWidth") > width:
                wide.append(f"{name} at {width} pixels")
    view.close()
    assert [url for url in asked if not url.startswith((address, "data:"))] == []
    assert complaints == []
    assert wide == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_page_has_a_serious_or_critical_violation_of_accessibility(site, address, browser, scheme):
    from axe_playwright_python.sync_playwright import Axe

    view = browser.new_page(viewport={"width": 1280, "height": 900}, color_scheme=scheme)
    found = []
    for name in pages(site):
        view.goto(f"{address}/{name}", wait_until="networkidle")
        for violation in Axe().run(view).response["violations"]:
            if violation["impact"] in ("serious", "critical"):
                places = [node["html"][:160] for node in violation["nodes"][:3]]
                found.append((name, violation["id"], len(violation["nodes"]), places))
    view.close()
    assert found == []


def test_on_every_lessons_page_a_slider_changes_the_picture(site, address, browser, screenshots):
    view = browser.new_page(viewport={"width": 1280, "height": 900})
    for name in lessons(site):
        view.goto(f"{address}/{name}")
        for player in view.locator(".stairlab-player").all():
            picture = player.locator("img")
            before, words = picture.get_attribute("src"), picture.get_attribute("alt")
            slider = player.locator("input").first
            slider.focus()
            view.keyboard.press("End")
            if picture.get_attribute("src") == before:
                view.keyboard.press("Home")
            assert picture.get_attribute("src") != before
            assert picture.get_attribute("alt") != "" != words
        view.screenshot(path=screenshots / f"book_{Path(name).stem}.png")
    view.close()


def test_an_animation_plays_pauses_and_steps(site, address, browser):
    view = browser.new_page(viewport={"width": 1280, "height": 900})
    view.goto(f"{address}/{lessons(site)[3]}")
    player = view.locator(".stairlab-player", has=view.locator("[data-do=play]")).first
    slider, play = player.locator("input"), player.locator("[data-do=play]")
    player.locator("[data-do=on]").click()
    assert slider.input_value() == "1"
    play.click()
    assert play.inner_text() == "Pause"
    view.wait_for_function("element => Number(element.value) > 1", arg=slider.element_handle())
    play.click()
    assert play.inner_text() == "Play"
    view.close()


def test_the_site_opens_from_the_file_system(site, browser):
    view = browser.new_page()
    asked, complaints = listen(view)
    for name in ["index.html", *lessons(site)[:3], "search.html"]:
        view.goto((site / name).as_uri(), wait_until="networkidle")
        if view.locator(".math").count():
            view.wait_for_selector("mjx-container")
    view.close()
    assert [url for url in asked if not url.startswith(("file://", "data:"))] == []
    assert complaints == []


def test_the_search_finds_a_word(address, browser):
    view = browser.new_page()
    view.goto(f"{address}/search.html?q=riser")
    view.wait_for_selector("#search-results li a")
    view.close()
