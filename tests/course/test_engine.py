"""What lessons say of the authors' engine is what its jumps on treads show."""

import re
from pathlib import Path

import nbformat
import numpy as np
import pytest

from stairlab.course.engine import ENGINE, ENGINE_GAPS, beside_engine, tread_figures
from stairlab.fidelity import Rollouts, TreadMeasures, roll_out
from stairlab.physics import Staircase
from stairlab.world import StairWorld

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"


@pytest.fixture(scope="module")
def of_engine(reference_csv):
    path = reference_csv.with_name("tread_jumps.csv")
    if not path.is_file():
        pytest.skip(f"The jumps from treads are not at {path}; STAIRLAB_REFERENCE can name the folder that holds them.")
    return TreadMeasures.of(Rollouts.from_csv(path))


def test_the_engine_s_figures_are_those_of_its_jumps(of_engine):
    assert tread_figures(of_engine) == ENGINE
    assert of_engine.n_jumps == 6003
    assert (of_engine.gaps < 0.03).sum() == 2031  # lesson 8 names this number


def test_the_engine_s_gaps_are_those_of_its_jumps(of_engine):
    gaps = 1000 * np.quantile(of_engine.gaps, np.array(list(ENGINE_GAPS)) / 100)
    assert list(ENGINE_GAPS.values()) == pytest.approx(gaps, rel=0.01, abs=0.005)


def test_a_world_stands_beside_the_engine_with_the_same_figures():
    measured = TreadMeasures.of(roll_out(StairWorld(Staircase.fifteen()), 10, progress=False))
    table = beside_engine({"plane": measured})
    assert list(table.columns) == ["the authors' engine", "plane"]
    assert table.index.tolist() == list(ENGINE)
    assert table["plane"]["turned by more than 5°"] == "0 %"
    assert table["plane"]["a moderate jump climbs"] == f"{100 * measured.climb:.0f} %"


@pytest.mark.parametrize(
    ("lesson", "pattern", "figure"),
    [
        ("08_up_the_stairs", r"it freed (\d+ %)", "of these, free after one more jump"),
        ("10_does_it_hold_up", r"In the engine (\d+ %) of the cubes lie within 3 cm", "within 3 cm of the riser"),
    ],
)
def test_the_texts_of_lessons_quote_these_figures(lesson, pattern, figure):
    notebook = nbformat.read(NOTEBOOKS / f"{lesson}.ipynb", as_version=4)
    assert re.findall(pattern, "\n".join(cell.source for cell in notebook.cells)) == [ENGINE[figure]]
