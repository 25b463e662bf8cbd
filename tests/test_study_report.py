"""What a study leaves beside its runs: tables, figures and a report that stands alone."""

import re

import pandas as pd
import pytest
from small_study import made_up

from stairlab.study_report import save_study

SETS = {"effect": [3.0, 2.0], "uniform": [15.0, 4.0]}


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    save_study(made_up(SETS | {"sac": [15.0]}, samples={"effect": 2000}), folder, progress=False)
    return folder


@pytest.fixture(scope="module")
def report(saved):
    return (saved / "report.html").read_text()


def text_of(report):
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", re.sub(r"<style>.*?</style>", "", report, flags=re.DOTALL)))


def test_tables_and_figures_lie_in_folders_of_their_own(saved):
    assert {path.name for path in (saved / "tables").iterdir()} == {
        *(f"{name}.csv" for name in ("runs", "evaluations", "motions", "episodes", "summary", "claims")),
        "description.json",
    }
    assert {path.stem for path in (saved / "figures").iterdir()} == {
        "figure_4a_learning_curves",
        "figure_4b_learning_curves",
        "learning_certainty",
        "scores",
        "improvement",
        "traps",
        "last_episodes",
    }


def test_the_report_asks_no_other_host_for_anything(report):
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", report)
    assert report.count("<img") == 7
    assert all(len(alt) > 30 for alt in re.findall(r'alt="([^"]*)"', report))


def test_the_report_holds_the_scores_the_claims_and_the_command(report):
    text = text_of(report)
    assert re.search(r"effect-based 2 2\.0 2\.5", text)
    assert "Effect-based prototypes achieve the highest mean return" in text
    assert "stairlab study --timesteps 30000 --world plane --methods effect uniform --seeds 0-1" in text
    assert "Not the paper’s study: it is in the plane, where a cube neither turns nor rolls." in text
    assert "These verdicts are about the plane." in text
    assert "nan" not in text


def test_what_differs_from_the_papers_study_is_named(tmp_path):
    results = made_up(SETS)
    results.description["settings"] |= {"dqn": {"gamma": 0.9}, "restitution": 0.0}
    save_study(results, tmp_path, progress=False)
    text = text_of((tmp_path / "report.html").read_text())
    assert "DQN has other settings than the published ones and the risers have a restitution of 0.0" in text


def test_a_quick_study_is_marked_in_the_report_and_in_each_table_that_is_read(tmp_path):
    save_study(made_up(SETS, quick=True), tmp_path, progress=False)
    assert "A quick study." in text_of((tmp_path / "report.html").read_text())
    for name in ("summary", "claims"):
        assert pd.read_csv(tmp_path / "tables" / f"{name}.csv")["quick"].all()


def test_studies_of_one_method_and_where_nobody_is_stuck_are_reported_too(tmp_path):
    for name, scores in (("sac", {"sac": [3.0]}), ("top", {"uniform": [15.0]}), ("own", {"mine": [15.0, 3.0]})):
        save_study(made_up(scores), tmp_path / name, progress=False)
        assert "nan" not in text_of((tmp_path / name / "report.html").read_text())
