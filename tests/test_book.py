"""The web book: the paper map names what exists, the site is built without a warning, and its links lead somewhere."""

import functools
import importlib
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from notebooks_under_test import PROJECT, load

pytest.importorskip("sphinx", reason="The book needs Sphinx: pip install 'stairlab[book]'.")
PREPARE = load("book/prepare.py")
MAP = PREPARE.read_paper_map()


def named(column: str) -> list[str]:
    return sorted({name for row in MAP for name in row[column].split()})


@pytest.mark.parametrize(
    ("alt", "caption"),
    [
        ("A cube. It rests.", "A cube."),
        ("the curves of 3 seeds: 1, 2 and 0.5. one is high", "The curves of 3 seeds: 1, 2 and 0.5."),
        (f"Scores by class: {'C1 (one) 0.12, ' * 9}C2 1.", "Scores by class."),
        ("ξ_k of 6 classes", r"ξ\_k of 6 classes."),
    ],
)
def test_a_caption_is_the_first_sentence_without_long_lists(alt, caption):
    assert PREPARE.caption(alt) == caption


def test_the_map_has_every_section_algorithm_equation_figure_and_appendix_of_the_paper():
    parts = {row["part"] for row in MAP}
    wanted = [f"Section {i}" for i in ("1", "2", "3", "3.1", "3.2", "3.3", "4", "5", "6")]
    wanted += (
        [f"Algorithm {i}" for i in (1, 2)]
        + [f"Equation {i}" for i in range(1, 6)]
        + [f"Figure {i}" for i in range(1, 8)]
    )
    assert parts == {*wanted, "Appendix A", "Appendix B", "Appendix C"}
    assert len(MAP) == len(parts)


@pytest.mark.parametrize("name", named("function") + named("figure"))
def test_every_function_of_the_map_exists(name):
    module, *path = name.split(".")
    assert functools.reduce(getattr, path, importlib.import_module(f"stairlab.{module}")) is not None


@pytest.mark.parametrize("name", named("test"))
def test_every_test_of_the_map_exists(name):
    file, _, test = name.partition("::")
    assert any(f"def {test}(" in path.read_text() for path in (PROJECT / "tests").rglob(file))


@pytest.mark.parametrize("name", named("lesson"))
def test_every_lesson_of_the_map_exists(name):
    assert (PROJECT / "notebooks" / f"{name}.ipynb").is_file()


def test_every_part_but_related_work_leads_to_code_and_every_part_to_a_lesson():
    for row in MAP:
        assert row["lesson"], row["part"]
        assert row["function"] or row["part"] == "Section 2"


def test_every_numbered_departure_is_described():
    text = (PROJECT / "notebooks" / "DEPARTURES.md").read_text()
    numbers = re.findall(r"^\| \[(\d+)\]", text, re.MULTILINE)
    assert numbers == [str(i) for i in range(1, 24)]
    assert re.findall(r"^## Departure (\d+)", text, re.MULTILINE) == numbers


# The site


class Page(HTMLParser):
    """The links and the anchors of a page, and its pictures without alternative text."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors = {""}
        self.silent: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.anchors.add(found.get("id") or "")
        self.links += [found[name] for name in ("href", "src") if found.get(name)]
        if tag == "img" and not (found.get("alt") or "").strip():
            self.silent.append(found.get("src", "")[:80])


@functools.lru_cache
def page(path: Path) -> Page:
    return Page(path)


def pages(site: Path) -> Iterator[Path]:
    return (path for path in site.rglob("*.html") if "_static" not in path.parts)


def leads_somewhere(target: Path, anchor: str) -> bool:
    return target.exists() and (target.suffix != ".html" or anchor in page(target.resolve()).anchors)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_every_link_inside_the_site_leads_somewhere(site):
    broken = []
    for path in pages(site):
        for link in page(path).links:
            parts = urlsplit(link)
            target = path.parent / unquote(parts.path) if parts.path else path
            if not (parts.scheme or parts.netloc or leads_somewhere(target, unquote(parts.fragment))):
                broken.append(f"{path.relative_to(site)}: {link}")
    assert broken == []


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_every_picture_of_the_site_has_alternative_text(site):
    assert {path.name: page(path).silent for path in pages(site) if page(path).silent} == {}


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_every_lesson_and_exercise_is_a_page_and_no_solution_is(site):
    made = {path.stem for path in (site / "made" / "course").rglob("*.html")}
    assert {path.stem for path in (PROJECT / "notebooks").glob("[0-9]*.ipynb")} <= made
    assert not list(site.rglob("solutions/*.html"))


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_the_site_is_under_40_megabytes_and_a_page_under_3(site):
    files = [path for path in site.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 40e6
    for path in pages(site):
        pictures = [path.parent / unquote(link) for link in page(path).links if link.endswith(".png")]
        assert path.stat().st_size + sum(picture.stat().st_size for picture in set(pictures)) < 3e6, path.name
