"""The lessons: what each must have, that they run without errors or warnings, and that they are committed clean."""

import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from notebooks_under_test import PROJECT, execute

LESSONS, SOLUTIONS, STUDENT_VERSIONS = execute.LESSONS, execute.SOLUTIONS, execute.STUDENT_VERSIONS
executed = execute.executed

NOTEBOOKS = PROJECT / "notebooks"
COMMITTED = [
    path
    for folder in ("", "exercises/", "exercises/solutions/", "exercises/source/*/")
    for path in sorted(NOTEBOOKS.glob(f"{folder}*.ipynb"))
]
TITLES = [
    "00_welcome",
    "01_the_world",
    "02_sampling",
    "03_effect_classes",
    "04_how_many_classes",
    "05_how_many_prototypes",
    "06_growing_neural_gas",
    "07_action_prototypes",
    "08_up_the_stairs",
    "09_learning_to_climb",
    "10_does_it_hold_up",
]
LONGEST = {"09_learning_to_climb": 180}
""" What a lesson may take to run where it is not 60 s [s] """
each_lesson = pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
each_notebook = pytest.mark.parametrize("path", COMMITTED, ids=lambda path: str(path.relative_to(NOTEBOOKS)))


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.read(path, as_version=4)


def prose(path: Path) -> str:
    return "\n\n".join(cell.source for cell in read(path).cells if cell.cell_type == "markdown")


def code(path: Path) -> str:
    return "\n".join(cell.source for cell in read(path).cells if cell.cell_type == "code")


def outputs(notebook: nbformat.NotebookNode) -> list:
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def html_of(notebook: nbformat.NotebookNode) -> str:
    return "\n".join(output.get("data", {}).get("text/html", "") for output in outputs(notebook))


def stated_times(path: Path) -> tuple[int, int]:
    """Return how long a lesson says that it takes: to read [min], and to run [s]."""
    return tuple(map(int, re.search(r"\*\*Time\*\* (\d+) minutes to read, (\d+) seconds to run", prose(path)).groups()))


def test_there_are_eleven_lessons_and_exercises_for_all_but_the_first():
    assert [path.stem for path in LESSONS] == TITLES
    assert [path.stem for path in SOLUTIONS][:10] == TITLES[1:]


# Each is executed once


@pytest.mark.slow
@each_lesson
def test_a_lesson_runs_without_errors_or_warnings(path):
    notebook = executed(path)
    assert [output.text for output in outputs(notebook) if output.get("name") == "stderr"] == []
    assert "Warning" not in "".join(output.get("text", "") for output in outputs(notebook))
    assert notebook.metadata.stairlab.seconds < 3 * stated_times(path)[1], (
        "something hangs: three times the stated time"
    )


@pytest.mark.slow
@each_lesson
def test_every_picture_of_a_lesson_has_alternative_text(path):
    shown = [output.get("data", {}) for output in outputs(executed(path))]
    assert [data for data in shown if "image/png" in data or "image/svg+xml" in data] == []
    texts = re.findall(r"<img\b[^>]*>", html_of(executed(path)))
    assert [text[:200] for text in texts if not re.search(r'\balt="[^"]{15,}"', text)] == []


@pytest.mark.slow
@each_lesson
def test_a_lesson_has_a_picture_for_each_minute(path):
    assert len(re.findall(r"<img\b", html_of(executed(path)))) >= stated_times(path)[0]


@pytest.mark.slow
@each_lesson
def test_a_lesson_shows_something_that_reacts_without_a_kernel(path):
    assert 'class="stairlab-player"' in html_of(executed(path))


# What each must have


@each_lesson
def test_a_lesson_opens_with_what_one_will_be_able_to_do_what_one_needs_and_how_long_it_takes(path):
    opening = read(path).cells[0].source
    assert opening.startswith("# ")
    assert "**You will be able to**" in opening
    assert "**You need**" in opening
    reading, running = stated_times(path)
    assert 20 <= reading <= 45
    assert running <= LONGEST.get(path.stem, 60)


@each_lesson
def test_a_lesson_asks_for_two_predictions_at_least(path):
    assert len(re.findall(r"\bpredict\(", code(path))) >= 2


@each_lesson
def test_a_lesson_has_a_widget_that_needs_only_the_setup(path):
    tags = [cell.metadata.get("tags", []) for cell in read(path).cells if cell.cell_type == "code"]
    assert any("widget" in found for found in tags)
    assert "setup" in tags[0]


@each_lesson
def test_a_lesson_ends_with_five_sentences_where_things_are_and_what_to_read(path):
    text = prose(path)
    summary = text.split("## Summary")[1].split("\n## ")[0]
    assert len(re.findall(r"^\d\. ", summary, re.MULTILINE)) == 5
    assert "## Where this is" in text
    reading = text.split("## Read on")[1].split("\n## ")[0]
    assert 2 <= len(re.findall(r"^[-*] ", reading, re.MULTILINE)) <= 4


@each_lesson
def test_cells_of_a_lesson_are_short(path):
    for cell in read(path).cells:
        if cell.cell_type == "code":
            assert len(cell.source.splitlines()) <= 22, cell.id


# How they are kept


@each_notebook
def test_a_notebook_is_committed_clean(path):
    notebook = read(path)
    assert set(notebook.metadata) == {"kernelspec"}
    ids = [cell.id for cell in notebook.cells]
    assert len(set(ids)) == len(ids)
    for cell in notebook.cells:
        assert not cell.get("outputs")
        assert not cell.get("execution_count")
        assert set(cell.metadata) <= {"tags", "nbgrader", "deletable", "editable"}


@each_notebook
def test_links_between_notebooks_lead_somewhere(path):
    for target in re.findall(r"\]\((?!https?://|#)([^)\s]+)\)", prose(path)):
        name = target.split("#")[0]
        base = path.parent if "source" not in path.parts else NOTEBOOKS / "exercises"
        assert (base / name).exists(), target


@each_notebook
def test_files_and_tests_that_a_notebook_names_exist(path):
    for name in re.findall(r"`([\w/]+\.py|[a-z]+/[\w/]+\.\w+)", prose(path)):
        assert (PROJECT / name).is_file(), name


def test_prose_is_spelled_right():
    pages = [*NOTEBOOKS.rglob("*.md"), PROJECT / "README.md", *COMMITTED]
    run = subprocess.run(
        [sys.executable, "-m", "codespell_lib", *map(str, pages)], capture_output=True, text=True, check=False
    )
    assert run.stdout == ""


@pytest.fixture
def small_notebook(tmp_path, monkeypatch) -> Path:
    """A notebook of its own project, executed there."""
    for folder in ("notebooks", "stairlab"):
        (tmp_path / folder).mkdir()
    (tmp_path / "requirements.txt").write_text("")
    monkeypatch.setattr(execute, "PROJECT", tmp_path)
    monkeypatch.setattr(execute, "EXECUTED", tmp_path / "build")
    path = tmp_path / "notebooks" / "a.ipynb"
    nbformat.write(
        nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("import time; print(time.time_ns())")]), path
    )
    return path


@pytest.mark.slow
def test_a_notebook_is_executed_again_only_if_it_or_the_library_changed(small_notebook):
    first = execute.executed(small_notebook)
    assert execute.executed(small_notebook) == first
    (small_notebook.parents[1] / "stairlab" / "new.py").write_text("a = 1")
    second = execute.executed(small_notebook)
    assert second.cells[0].outputs != first.cells[0].outputs
    text = small_notebook.read_text()
    small_notebook.write_text(text.replace("time.time_ns()", "1 + 1"))
    assert execute.executed(small_notebook).cells[0].outputs[0].text == "2\n"


# Exercises


@pytest.mark.slow
@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
def test_solutions_run_without_errors_or_warnings(path):
    said = [output for output in outputs(executed(path)) if output.get("name") == "stderr"]
    assert said == []


@pytest.mark.slow
@pytest.mark.parametrize("path", STUDENT_VERSIONS, ids=lambda path: path.stem)
def test_exercises_that_are_not_done_raise_nothing_but_their_own_error(path):
    errors = [output for output in outputs(executed(path, allow_errors=True)) if output.output_type == "error"]
    assert {error.ename for error in errors} <= {"NotImplementedError"}
