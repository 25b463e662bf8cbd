"""The studies that come with the package: whole, small, consistent with themselves, and what the README says of them."""

from pathlib import Path

import numpy as np
import pytest

from stairlab import Staircase, StairWorld
from stairlab.beyond import TUNED_DQN
from stairlab.claims import paper_claims
from stairlab.results import load_published_study, published_studies
from stairlab.study import METHODS, Settings, motion_set

PROJECT = Path(__file__).parents[1]
PARTS = ("beyond", "paper", "restitution-0", "restitution-0.1")


@pytest.fixture(scope="module", params=PARTS)
def study(request):
    return load_published_study(request.param)


@pytest.fixture(scope="module")
def paper():
    return load_published_study()


def markdown(cells):
    return f"| {' | '.join(cells)} |"


def summary_rows(results):
    for row in results.summary().to_dict("records"):
        interval = "" if np.isnan(row["low"]) else f"{row['low']:.1f} to {row['high']:.1f}"
        found = "" if np.isnan(row["best return"]) else f"{row['best return']:.1f}"
        actions = "" if np.isnan(row["actions"]) else f"{row['actions']:.1f}"
        numbers = [f"{row['mean']:.1f}", f"{row['sd']:.1f}", f"{row['iqm']:.1f}", interval, f"{row['at the top']:.0%}"]
        yield markdown([row["method"], str(row["seeds"]), actions, *numbers, found])


def claim_rows(results):
    for says, finds, verdict in paper_claims(results).to_numpy():
        yield markdown([says, finds, f"**{verdict}**"])


def test_the_parts_are_known_by_name():
    assert published_studies() == sorted(PARTS)
    with pytest.raises(ValueError, match="part must be one of 'beyond', 'paper'"):
        load_published_study("figure 4")


def test_the_paper_is_repeated_at_its_scale_with_enough_seeds(paper):
    seeds = paper.runs.groupby("method")["seed"].nunique()
    assert set(seeds.index) == set(METHODS)
    assert (seeds.drop("sac") >= 20).all()
    assert seeds["sac"] >= 5
    assert paper.description["settings"] | {"restitution": None, "dqn": {}, "sac": {}} == paper.description["settings"]
    assert paper.description["settings"]["total_timesteps"] == 30_000


def test_each_part_differs_from_the_paper_in_what_its_name_says():
    settings = {part: load_published_study(part).description["settings"] for part in PARTS}
    common = settings["paper"]
    assert settings["beyond"] == common | {"dqn": TUNED_DQN}
    assert settings["restitution-0"] == common | {"restitution": 0.0}
    assert settings["restitution-0.1"] == common | {"restitution": 0.1}


def test_every_run_is_evaluated_every_500_steps_and_its_score_is_the_mean_of_the_last_five(study):
    score_of = study.runs.set_index(["method", "seed"])["score"]
    for run, rows in study.evaluations.groupby(["method", "seed"]):
        assert rows["step"].tolist() == list(range(500, 30_500, 500))
        assert score_of[run] == pytest.approx(rows["return"].iloc[-5:].mean())


def test_no_run_is_better_than_the_search_allows(study):
    best = study.evaluations.groupby(["method", "seed"])["return"].max()
    bound = study.runs.set_index(["method", "seed"])["bound"].dropna()
    assert (best[bound.index] <= bound + 0.5).all()  # in whole steps


def test_the_sets_can_be_made_again(paper):
    for method in ("effect", "fixed", "random", "uniform-matched"):
        shipped = paper.motions.query("method == @method and seed == 0")[["magnitude", "angle"]]
        assert np.allclose(motion_set(method, 0, Settings(world="plane")).motions, shipped, rtol=1e-6)


def test_the_last_episodes_can_be_jumped_again(study):
    world = StairWorld(Staircase.fifteen(study.description["settings"]["restitution"]))
    for _, episode in list(study.episodes.groupby(["method", "seed"]))[:3]:
        world.reset()
        for row in episode.itertuples():
            motion = np.array([row.magnitude, row.angle], dtype=np.float32).astype(float)
            jump = world.perform(motion)
            assert (jump.end[1], jump.end[2]) == pytest.approx((row.y, row.z), abs=1e-6)


def test_all_of_it_is_less_than_two_megabytes():
    files = (PROJECT / "stairlab/data").rglob("*.*")
    assert sum(file.stat().st_size for file in files) < 2e6


@pytest.mark.parametrize("part", PARTS)
def test_the_tables_in_the_readme_are_those_of_the_shipped_study(part):
    results = load_published_study(part)
    rows = [*summary_rows(results), *(claim_rows(results) if part == "paper" else ())]
    text = (PROJECT / "README.md").read_text()
    missing = [row for row in rows if row not in text]
    assert not missing, "README.md lacks:\n" + "\n".join(missing)
