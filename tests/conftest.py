"""What several test files share."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from filelock import FileLock

from stairlab.sampling import Samples, sample_motions
from stairlab.world import StairWorld

os.environ.setdefault("SCIPY_ARRAY_API", "1")  # else scikit-learn skips some of its checks of estimators
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts background jobs with Ctrl-C ignored
PROJECT = Path(__file__).parents[1]


DRAWING = (
    "course/",
    "test_study.py",
    "test_study_plots.py",
    "test_study_report.py",
    "test_claims.py",
    "test_pipeline.py",
    "test_report.py",
)
""" Tests that draw many pictures or make many runs: each takes a moment, together they take minutes """


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of some files as slow."""
    for item in items:
        if str(item.path.relative_to(PROJECT / "tests")).startswith(DRAWING):
            item.add_marker(pytest.mark.slow)


@pytest.fixture
def world() -> StairWorld:
    """Return the paper's four-step world, in its start pose."""
    return StairWorld()


@pytest.fixture(scope="session")
def samples() -> Samples:
    """Return the default samples: 2,000 uniform jumps from the start pose, seed 0."""
    return sample_motions(StairWorld(), n=2000, seed=0, progress=False)


@pytest.fixture(scope="session")
def reference_csv() -> Path:
    """Return the path of the authors' recorded jumps, which are not part of the project."""
    named = os.environ.get("STAIRLAB_REFERENCE")
    path = Path(named or PROJECT / "../shared/reference")
    path = path / "gazebo_jumps.csv" if path.is_dir() else path
    if named and not path.is_file():
        pytest.fail(f"STAIRLAB_REFERENCE names {path}, which is not a file.")
    if not path.is_file():
        pytest.skip(f"The recorded jumps are not at {path}; STAIRLAB_REFERENCE can name another place.")
    return path


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print how long the lessons took to run, beside what they state."""
    rows = []
    for path in sorted((PROJECT / "build" / "executed" / "notebooks").glob("[0-9][0-9]_*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        stated = re.search(r"(\d+) seconds to run", notebook.cells[0].source)
        if stated and "stairlab" in notebook.metadata:
            rows.append(f"{path.stem:24}{notebook.metadata.stairlab.seconds:8.1f}{int(stated[1]):8}")
    if rows:
        terminalreporter.section("lessons: run time [s]")
        terminalreporter.write_line(f"{'':24}{'now':>8}{'stated':>8}")
        for row in rows:
            terminalreporter.write_line(row)


@pytest.fixture(scope="session")
def site() -> Path:
    """The web book, built without a warning; what did not change since the last build is used again."""
    built = PROJECT / "book" / "_build" / "html"
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "-q", "-b", "html"]
    command += ["-d", built.parent / "doctrees-html", PROJECT / "book", built]
    students = {name: value for name, value in os.environ.items() if name != "STAIRLAB_TEACHERS"}
    (PROJECT / "build").mkdir(exist_ok=True)
    with FileLock(PROJECT / "build" / "site.lock"):  # tests may run in several processes
        run = subprocess.run(command, env=students, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr[-5000:]
    return built
