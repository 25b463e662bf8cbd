"""The studies that come with the package: whole, small, consistent with themselves, and what the README says of them."""

from pathlib import Path

import numpy as np
import pytest

from stairlab import Staircase, StairWorld
from stairlab.beyond import TUNED_DQN
from stairlab.claims import compare_claims, paper_claims
from stairlab.results import load_published_study, published_studies
from stairlab.study import METHODS, Settings, motion_set

PROJECT = Path(__file__).parents[1]
PLANE = ("beyond", "plane", "restitution-0", "restitution-0.1")
OPTIONS = {
    "tumbling-friction-0.8": {"friction": 0.8},
    "tumbling-friction-1.2": {"friction": 1.2},
    "tumbling-rocking-0.5": {"rocking": 0.5},
    "tumbling-rocking-2": {"rocking": 2.0},
}
TUMBLING = ("tumbling", "tumbling-as-published", "tumbling-beyond", *OPTIONS)
PARTS = (*PLANE, *TUMBLING)


@pytest.fixture(scope="module", params=PARTS)
def study(request):
    return load_published_study(request.param)


@pytest.fixture(scope="module", params=PLANE)
def in_the_plane(request):
    return load_published_study(request.param)


@pytest.fixture(scope="module")
def tumbling():
    return load_published_study("tumbling")


@pytest.fixture(scope="module")
def paper():
    return load_published_study("plane")


def markdown(cells):
    return f"| {' | '.join(cells)} |"


def summary_rows(results):
    for row in results.summary().to_dict("records"):
        interval = "" if np.isnan(row["low"]) else f"{row['low']:.1f} to {row['high']:.1f}"
        found = "" if np.isnan(row["best return"]) else f"{row['best return']:.1f}"
        actions = "" if np.isnan(row["actions"]) else f"{row['actions']:.1f}"
        numbers = [f"{row['mean']:.1f}", f"{row['sd']:.1f}", f"{row['iqm']:.1f}", interval, f"{row['at the top']:.0%}"]
        yield markdown([row["method"], str(row["seeds"]), actions, *numbers, found])


def control_rows(tumbling, published):
    """The positive controls: the median score, its range, and the seeds."""
    controls = {
        "SAC, which may use any motion": (tumbling, "sac", "15, in the paper"),
        "SAC, the authors' readings": (published, "sac", "14 and 15, 2 seeds"),
        "the authors' own set, their readings": (published, "authors", "5.5 (3.4 to 8.4), 8 seeds"),
        "the grid, their readings": (published, "uniform", "0.1 (-4.9 to 3.0), 8 seeds"),
    }
    for name, (results, method, engine) in controls.items():
        scores = results.scores(method)
        found = f"{scores.mean():.1f} ({scores.min():.1f} to {scores.max():.1f}), {len(scores)} seeds"
        yield markdown([name, engine, found])


def claim_rows(tumbling, plane):
    theirs = paper_claims(tumbling.with_effect_sets("authors")).set_index("the paper says")["among all rows"]
    for row in compare_claims(tumbling, plane).to_dict("records"):
        says, alone, among = row["the paper says"], row["verdict"], row["among all rows"]
        verdict = f"**{alone}**" if alone == among else f"{alone}; among all rows **{among}**"
        there = f"{row['verdict in the plane']}: {row['in the plane']}"
        yield markdown([says, row["we find"], row["seeds"], verdict, theirs[says], there])


def steep_rows(tumbling, plane):
    """What a steep motion is worth to the effect-based sets, and its corners to the grid."""
    pairs = {
        "effect-based sets with 600 N at 89 degrees − without": ("effect-plus-steep", "effect"),
        "the grid − the grid without its corners": ("uniform", "uniform-no-corners"),
    }
    for name, pair in pairs.items():
        yield markdown([name, str(plane.difference(*pair)), str(tumbling.difference(*pair))])


def grid_rows(tumbling):
    """Effect-based sets of three kinds against the paper's grid, other grids, and random sets of their size."""
    for name, ours in {
        "effect-based": "effect",
        "effect-based, reliable": "effect-reliable",
        "the authors' set": "authors",
    }.items():
        rivals = ("uniform", "uniform-shifted", "random-matched")
        yield markdown([name, *(str(tumbling.difference(ours, rival)) for rival in rivals)])


def option_rows(tumbling):
    """The same study with another rocking or friction."""
    sets = ["effect", "authors", "uniform", "random"]
    parts = {part.removeprefix("tumbling-").replace("-", " "): load_published_study(part) for part in OPTIONS}
    for name, part in (parts | {"as they are": tumbling.selected(sets, range(6))}).items():
        means = [f"{part.scores(method).mean():.1f}" for method in sets]
        yield markdown([name, *means, *(str(part.difference(method, "uniform")) for method in ("effect", "authors"))])


def reasons(tumbling, plane):
    table = compare_claims(tumbling, plane)
    return [f"- {reason}" for reason in dict.fromkeys(table["why they differ"]) if reason]


def test_the_parts_are_known_by_name():
    assert published_studies() == sorted(PARTS)
    with pytest.raises(ValueError, match="part must be one of 'beyond', 'plane'"):
        load_published_study("figure 4")


def test_the_paper_is_repeated_at_its_scale_with_enough_seeds(paper):
    seeds = paper.runs.groupby("method")["seed"].nunique()
    assert set(METHODS) <= set(seeds.index)
    assert (seeds[list(METHODS)].drop("sac") >= 20).all()
    assert seeds["sac"] >= 5
    assert paper.description["settings"] | {"restitution": None, "dqn": {}, "sac": {}} == paper.description["settings"]
    assert paper.description["settings"]["total_timesteps"] == 30_000


def test_each_part_differs_from_the_paper_in_what_its_name_says():
    settings = {part: load_published_study(part).description["settings"] for part in PARTS}
    common = settings["plane"]
    assert [settings[part]["world"] for part in PARTS] == ["plane"] * len(PLANE) + ["tumbling"] * len(TUMBLING)
    assert settings["tumbling-as-published"] == settings["tumbling"] | {"as_published": True}
    for part, changed in OPTIONS.items():
        assert settings[part] == settings["tumbling"] | changed
    assert settings["tumbling-beyond"] == settings["tumbling"] | {"dqn": TUNED_DQN}
    assert settings["beyond"] == common | {"dqn": TUNED_DQN}
    assert settings["restitution-0"] == common | {"restitution": 0.0}
    assert settings["restitution-0.1"] == common | {"restitution": 0.1}


def test_every_run_is_evaluated_every_500_steps_and_its_score_is_the_mean_of_the_last_five(study):
    score_of = study.runs.set_index(["method", "seed"])["score"]
    for run, rows in study.evaluations.groupby(["method", "seed"]):
        means = rows.groupby("step")["return"].mean()
        assert means.index.tolist() == list(range(500, 30_500, 500))
        assert score_of[run] == pytest.approx(means.iloc[-5:].mean(), abs=1e-4)


def test_no_run_is_better_than_the_search_allows(in_the_plane):
    study = in_the_plane
    best = study.evaluations.groupby(["method", "seed"])["return"].max()
    bound = study.runs.set_index(["method", "seed"])["bound"].dropna()
    assert (best[bound.index] <= bound + 0.5).all()  # in whole steps


def test_the_sets_can_be_made_again(paper):
    for method in ("effect", "fixed", "random", "uniform-matched"):
        shipped = paper.motions.query("method == @method and seed == 0")[["magnitude", "angle"]]
        assert np.allclose(motion_set(method, 0, Settings(world="plane")).motions, shipped, rtol=1e-6)


def test_where_cubes_tumble_an_evaluation_has_five_episodes_and_none_returns_more_than_the_stairs_have_steps(tumbling):
    assert tumbling.evaluations.groupby(["method", "seed", "step"])["episode"].nunique().eq(5).all()
    assert tumbling.evaluations["return"].max() < 15.2  # a leaning cube makes a difference of hundredths for each fall


def test_sets_of_the_tumbling_world_can_be_made_again_there(tumbling):
    for method in ("effect", "random"):
        shipped = tumbling.motions.query("method == @method and seed == 0")[["magnitude", "angle"]]
        assert np.allclose(motion_set(method, 0).motions, shipped, rtol=1e-6)


def test_the_positive_control_comes_near_the_papers_15(tumbling):
    assert (tumbling.runs["method"] == "sac").sum() >= 10
    assert np.median(tumbling.scores("sac")) > 13
    assert tumbling.curves("sac").to_numpy().max() > 14.9


def test_the_authors_motions_are_measured_with_and_not_handed_on(study):
    assert "authors" not in set(study.motions["method"])
    theirs = study.episodes[study.episodes["method"] == "authors"]
    assert theirs[["magnitude", "angle"]].isna().all(axis=None)


def test_the_last_episodes_can_be_jumped_again(in_the_plane):
    study = in_the_plane
    world = StairWorld(Staircase.fifteen(study.description["settings"]["restitution"]))
    for _, episode in list(study.episodes.groupby(["method", "seed"]))[:3]:
        world.reset()
        for row in episode.itertuples():
            motion = np.array([row.magnitude, row.angle], dtype=np.float32).astype(float)
            jump = world.perform(motion)
            assert (jump.end[1], jump.end[2]) == pytest.approx((row.y, row.z), abs=1e-6)


def test_all_of_it_is_less_than_eight_megabytes():
    files = (PROJECT / "stairlab/data").rglob("*.*")
    assert sum(file.stat().st_size for file in files) < 8e6


def test_the_tables_in_the_readme_are_those_of_the_shipped_studies(tumbling, paper):
    published = load_published_study("tumbling-as-published")
    rows = [*control_rows(tumbling, published), *summary_rows(tumbling), *summary_rows(paper)]
    rows += [*claim_rows(tumbling, paper), *reasons(tumbling, paper)]
    rows += [*steep_rows(tumbling, paper), *grid_rows(tumbling), *option_rows(tumbling)]
    text = (PROJECT / "README.md").read_text()
    missing = [row for row in rows if row not in text]
    assert not missing, "README.md lacks:\n" + "\n".join(missing)
