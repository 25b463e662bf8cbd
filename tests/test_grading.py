"""Exercises: one source, the versions made from it, and nbgrader's way from assignment to feedback."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from notebooks_under_test import PROJECT, load

pytest.importorskip("nbgrader", reason="Grading needs nbgrader: pip install 'stairlab[grading]'.")
generate = load("notebooks/exercises/generate.py")
EXERCISES = PROJECT / "notebooks" / "exercises"
ASSIGNMENTS = sorted(path.parent.name for path in EXERCISES.glob("source/*/*.ipynb"))


def test_students_and_solutions_notebooks_are_what_the_source_gives():
    for path, text in generate.versions().items():
        assert path.is_file(), f"{path.name} is missing: run make exercises"
        assert path.read_text(encoding="utf-8") == text, f"{path} is out of step: run make exercises"


def test_no_generated_notebook_is_left_over():
    made = [*EXERCISES.glob("*.ipynb"), *EXERCISES.glob("solutions/*.ipynb")]
    assert set(made) == set(generate.versions())


@pytest.mark.parametrize("name", ASSIGNMENTS)
def test_students_see_neither_solutions_nor_hidden_tests(name):
    text = (EXERCISES / f"{name}.ipynb").read_text()
    assert "BEGIN SOLUTION" not in text
    assert "HIDDEN" not in text
    assert "more=20" not in text


@pytest.mark.parametrize("name", [name for name in ASSIGNMENTS if not name.startswith("11")])
def test_each_lesson_has_two_to_four_exercises_with_a_stub_three_hints_and_a_check(name):
    cells = nbformat.read(EXERCISES / f"{name}.ipynb", as_version=4).cells
    stubs = [cell for cell in cells if cell.metadata.get("nbgrader", {}).get("solution")]
    checks = [cell for cell in cells if cell.metadata.get("nbgrader", {}).get("grade")]
    assert 2 <= len(stubs) <= 4
    assert len(checks) == len(stubs)
    for stub in stubs:
        assert f'raise NotImplementedError("{stub.metadata.nbgrader.grade_id}")' in stub.source
    prose = "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    for level in (1, 2, 3):
        assert prose.count(f"<summary>Hint {level}") == len(stubs)


@pytest.fixture(autouse=True)
def own_commands_first(monkeypatch) -> None:
    """Let nbgrader find its helpers where it is installed, also where the environment is not activated."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")


@pytest.fixture(scope="module")
def course(tmp_path_factory) -> Path:
    """A course folder as a teacher has it, with two submissions of each assignment: untouched, and the solutions."""
    folder = tmp_path_factory.mktemp("course")
    for name in ("generate.py", "nbgrader_config.py"):
        shutil.copy(EXERCISES / name, folder)
    shutil.copytree(EXERCISES / "source", folder / "source")
    return folder


def nbgrader(course: Path, *arguments: str) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "nbgrader", *arguments],
        cwd=course,
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert run.returncode == 0, run.stderr[-3000:]


def submit(course: Path, name: str) -> None:
    """Hand in an untouched assignment, and one with the solutions."""
    released = course / "release" / name / f"{name}.ipynb"
    solved = nbformat.read(released, as_version=4)
    answers = {
        cell.id: cell.source for cell in nbformat.read(EXERCISES / "solutions" / f"{name}.ipynb", as_version=4).cells
    }
    for cell in solved.cells:
        if cell.metadata.get("nbgrader", {}).get("solution"):
            cell.source = answers[cell.id]
    for student, notebook in (("empty", nbformat.read(released, as_version=4)), ("solved", solved)):
        folder = course / "submitted" / student / name
        folder.mkdir(parents=True)
        nbformat.write(notebook, folder / f"{name}.ipynb")


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", [name for name in ASSIGNMENTS if not name.startswith("11")])
def test_nbgrader_gives_an_untouched_assignment_nothing_and_the_solutions_full_marks(course, name):
    from nbgrader.api import Gradebook

    nbgrader(course, "generate_assignment", name)
    submit(course, name)
    nbgrader(course, "autograde", name)
    nbgrader(course, "generate_feedback", name)
    with Gradebook(f"sqlite:///{course}/gradebook.db", "stairlab") as gradebook:
        empty, solved = (gradebook.find_submission(name, student) for student in ("empty", "solved"))
        assert solved.max_score >= 2
        assert (empty.score, solved.score) == (0, solved.max_score)
    for student in ("empty", "solved"):
        assert "<html" in (course / "feedback" / student / name / f"{name}.html").read_text()
