import base64
import dataclasses
import re
from html.parser import HTMLParser
from itertools import pairwise

import pytest
from small_run import page, pictures, small_run

from stairlab import drawing
from stairlab import report as report_module
from stairlab.report import figures, listed, percent, render, write_report
from stairlab.tumbling import TumblingWorld

VOID = {"meta", "img", "br", "link", "input", "hr", "source"}


class Page(HTMLParser):
    """The report's elements, its text, and its tables as lists of cell texts."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.tables: list[list[list[str]]] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        if tag == "tr":
            self.tables[-1].append([])
        if tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" in self.open:
            return
        self.text += data
        if {"td", "th"} & set(self.open):
            self.tables[-1][-1][-1] += data


@pytest.fixture(scope="module")
def report() -> Page:
    parser = Page()
    parser.feed(page())
    parser.close()
    return parser


def table_of(report: Page, header: str) -> list[list[str]]:
    """Return the rows of the table whose header row has a given cell."""
    return next(rows[1:] for rows in report.tables if header in rows[0])


def test_all_tags_are_closed_and_the_language_is_named(report: Page) -> None:
    assert report.open == []
    assert ("html", {"lang": "en"}) in report.elements


def test_it_asks_nothing_of_the_network(report: Page) -> None:
    for tag, attributes in report.elements:
        assert tag not in ("script", "link", "iframe", "object", "embed")
        assert "srcset" not in attributes
        if "src" in attributes:
            assert attributes["src"].startswith("data:image/png;base64,")
        if "href" in attributes:
            assert tag == "a"
    assert not re.search(r"url\(|@import", page())


def test_links_within_the_page_lead_somewhere(report: Page) -> None:
    ids = [attributes["id"] for _, attributes in report.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    for _, attributes in report.elements:
        if (target := attributes.get("href") or "").startswith("#"):
            assert target[1:] in ids
        if "aria-labelledby" in attributes:
            assert attributes["aria-labelledby"] in ids


def test_headings_form_an_outline(report: Page) -> None:
    levels = [int(tag[1]) for tag, _ in report.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_every_figure_is_there_with_its_alternative_text(report: Page) -> None:
    images = [attributes for tag, attributes in report.elements if tag == "img"]
    assert len(images) == len(figures(small_run())) == len(pictures())
    for picture in pictures().values():
        assert {"src": picture.src, "alt": picture.alt} in images
        assert base64.b64decode(picture.src.split(",")[1]).startswith(b"\x89PNG")


def test_it_is_smaller_than_three_megabytes() -> None:
    assert len(page().encode()) < 3e6


def test_tables_scroll_in_boxes_that_a_keyboard_reaches(report: Page) -> None:
    boxes = [attributes for tag, attributes in report.elements if "scroll" in (attributes.get("class") or "").split()]
    assert len(boxes) == len(report.tables)
    assert all(box["tabindex"] == "0" and box["aria-label"] for box in boxes)
    assert sum(tag == "caption" for tag, _ in report.elements) == len(report.tables)


def test_classes_and_counts_are_those_of_the_run(report: Page) -> None:
    run = small_run()
    for row, number in zip(table_of(report, "mean Δy [m]"), run.classes.numbers, strict=True):
        assert row[0].strip() == f"C{number}"
        assert row[2] == f"{run.classes.sizes[number - 1]:,}"
        assert float(row[3]) == pytest.approx(run.classes.means[number - 1, 0], abs=6e-4)
        assert float(row[5]) == pytest.approx(run.classes.means[number - 1, 1], abs=6e-4)
    assert [int(row[-1]) for row in table_of(report, "product")] == run.counts["xi"].tolist()


def test_prototypes_and_reliability_are_those_of_the_run(report: Page) -> None:
    run = small_run()
    rows = table_of(report, "magnitude [N]")
    assert [float(row[1]) for row in rows] == run.prototypes["effect"].motions[:, 0].round().tolist()
    assert sum("✓" in row[3] for row in rows) / len(rows) == run.reliability["effect"].exact
    for row, measured in zip(table_of(report, "under noise"), run.summary().to_dict("records"), strict=True):
        assert row[0] == measured["method"]
        assert row[2:5] == [percent(measured[name]) for name in ("exact", "under noise", "on map")]


def test_the_choice_of_k_is_told_with_its_edge_and_the_other_readings(report: Page) -> None:
    run = small_run()
    words = " ".join(report.text.split())
    low, high = run.classes.settings["k_range"]
    assert f"tried k from {low} to {high} and chose k = {run.classes.n_classes}" in words
    assert ("the edge of the range" in words) == (run.classes.n_classes in (low, high))
    for row, (name, classes) in zip(table_of(report, "k chosen"), run.presets.items(), strict=True):
        assert row[0].startswith(name)
        assert int(row[4]) == classes.n_classes


def test_merging_classes_are_counted_over_the_resamples(report: Page) -> None:
    run = small_run()
    rows = table_of(report, "times")
    assert sum(int(row[0]) for row in rows) == len(run.merges)
    assert {row[3] for row in rows} == set(run.merges["together"])


def test_outcomes_add_up_to_all_jumps(report: Page) -> None:
    assert sum(int(row[1].replace(",", "")) for row in table_of(report, "height gained")) == small_run().n


def test_the_command_and_the_versions_are_named(report: Page) -> None:
    run = small_run()
    assert f"stairlab run --n {run.n} --seed {run.seed}\n" in report.text
    assert f"numpy {run.versions['numpy']}" in report.text


def test_the_command_of_a_run_in_the_tumbling_world_names_it() -> None:
    run = dataclasses.replace(small_run(), world=TumblingWorld())
    assert f"stairlab run --n {run.n} --seed {run.seed} --world tumbling<" in render(run, pictures())


def test_notes_are_shown_and_escaped() -> None:
    text = render(dataclasses.replace(small_run(), notes=("cv of C_1 is > 1 <really>",)), pictures())
    assert "cv of C_1 is &gt; 1 &lt;really&gt;" in text
    assert "Notes from this run" not in page()


def test_equal_figures_give_equal_pictures() -> None:
    name = "figure_2_effect_classes"
    assert drawing.png(figures(small_run())[name]()) == pictures()[name].png


def test_equal_runs_give_equal_pages(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(report_module, "draw_figures", lambda *_: pictures())
    write_report(small_run(), tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page()


def test_a_report_that_fails_leaves_no_file_and_an_old_one_as_it_was(tmp_path, monkeypatch) -> None:
    (tmp_path / "report.html").write_text("old")
    monkeypatch.setattr(drawing, "png", lambda *_: (_ for _ in ()).throw(MemoryError("no room")))
    with pytest.raises(MemoryError):
        write_report(small_run(), tmp_path / "report.html")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert (tmp_path / "report.html").read_text() == "old"


def test_shares_and_lists_read_well() -> None:
    assert percent(0.5) == "50\u202f%"
    assert percent(float("nan")) == "–"
    assert listed([7]) == "7"
    assert listed([7, 8, 10]) == "7, 8 and 10"
