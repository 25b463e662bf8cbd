"""Lesson 10: what its pictures show, at their defaults and at the edges of their controls, that its small models are right, and that
what it says of the plane is so.
"""

import dataclasses
import html
import math
from pathlib import Path

import nbformat
import numpy as np
import pytest
from scipy.stats import trim_mean

from stairlab import Staircase, StairWorld, alt_text, load_published_study
from stairlab.course import does_it_hold_up as lesson
from stairlab.course import explore
from stairlab.estimates import Estimate, estimate
from stairlab.fidelity import TreadMeasures, roll_out
from stairlab.tumbling import TumblingWorld

PROJECT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def study():
    return load_published_study("plane")


def texts(figure):
    """Return all words that are written in a figure."""
    words = [text.get_text() for ax in figure.axes for text in (*ax.texts, ax.title, ax.xaxis.label, ax.yaxis.label)]
    words += [ax.get_title(loc) for ax in figure.axes for loc in ("left", "right")]
    return " ".join(words + [tick.get_text() for ax in figure.axes for tick in ax.get_yticklabels()])


# How sure the reader is


def test_how_sure_the_reader_is_is_recorded_once_and_in_order():
    lesson.how_sure("First step.", percent=80)
    asked = lesson.how_sure("Second step.")
    assert "Second step." not in set(lesson.my_certainty()["when"])
    asked.commit("35.5")
    assert asked.commit(90).startswith("35.5 %")
    assert lesson.my_certainty().tail(2).to_numpy().tolist() == [["First step.", 80], ["Second step.", 35.5]]


@pytest.mark.parametrize("percent", [-1, 101, "much", None, float("nan")])
def test_what_is_no_percentage_is_refused(percent):
    with pytest.raises(ValueError, match="from 0 to 100"):
        lesson.Certainty("A step.").commit(percent)


def test_how_sure_is_asked_with_a_field_and_without_a_kernel_in_words():
    asked = lesson.Certainty("A step & more.")
    shown = asked._repr_mimebundle_()
    assert "A step &amp; more." in shown["text/html"]
    assert lesson.STATEMENT in shown["text/plain"]
    question, field, button, reply = asked.widget().children
    assert html.escape(lesson.STATEMENT) in question.value
    field.value = "many"
    button.click()
    assert "from 0 to 100" in reply.value
    assert not field.disabled
    field.value = "60"
    button.click()
    assert (asked.percent, field.disabled) == (60, True)
    assert "60 %" in asked._repr_mimebundle_()["text/plain"]


# Some of the seeds


def test_a_part_of_a_study_has_the_chosen_runs_and_their_tables(study):
    part = lesson.part_of(study, {"uniform": [3, 1], "sac": range(2)})
    assert part.methods == ["uniform", "sac"]
    assert list(part.scores("uniform")) == [study.scores("uniform")[1], study.scores("uniform")[3]]
    for table in (part.evaluations, part.episodes):
        assert set(table["seed"][table["method"] == "uniform"]) == {1, 3}
    assert set(part.motions["method"]) == {"uniform"}
    assert (
        part.command()
        == study.command().split(" --methods")[0]
        + " --methods uniform --seeds 1 3\n"
        + study.command().split(" --methods")[0]
        + " --methods sac --seeds 0-1"
    )


def test_with_more_seeds_a_draw_keeps_those_that_it_had(study):
    few, many = (lesson.drawn_seeds(study, n, turn=5) for n in (4, 20))
    for method in lesson.SETS:
        assert list(many[method][:4]) == list(few[method])
        assert sorted(many[method]) == list(range(20))
    assert list(lesson.drawn_seeds(study, 4, turn=0)["uniform"]) == [0, 1, 2, 3]


def test_other_draws_have_other_seeds(study):
    assert any(
        list(lesson.drawn_seeds(study, 4, 1)[method]) != list(lesson.drawn_seeds(study, 4, 2)[method])
        for method in lesson.SETS
    )


@pytest.mark.parametrize("turn", [0, 1, 4])
def test_drawn_curves_name_the_draw_and_the_order(study, turn):
    figure = lesson.draw_drawn_curves(study, turn)
    assert "mean scores: " in texts(figure)
    assert ("group" in texts(figure)) == bool(turn)
    assert "effect-based (4 seeds)" in alt_text(figure)


@pytest.mark.parametrize("seeds", [1, 4, 20])
@pytest.mark.parametrize("turn", [1, 12])
@pytest.mark.parametrize("answer", [False, True])
def test_the_widget_shows_what_was_drawn_and_with_the_answer_all_twenty(seeds, turn, answer):
    figure = lesson.draw_seen_seeds(seeds, turn, answer)
    (ax,) = figure.axes
    most = max(len(line.get_xdata()) for line in ax.lines)
    assert most == (20 if answer else max(seeds, 1))
    assert ("all 20" in alt_text(figure)) == answer
    assert ax.get_xlim() == (-0.8, 15.8)
    if answer and 1 < seeds < 20:
        assert "say what yours says" in texts(figure)


def test_the_widget_can_be_explored():
    exploration = explore(lesson.draw_seen_seeds, seeds=range(1, 21), turn=range(1, 13), answer=(False, True))
    assert exploration.start == {"seeds": 4, "turn": 1, "answer": False}


# Means, and how far to trust them


def test_means_of_draws_are_those_of_different_runs():
    rng, scores = np.random.default_rng(0), np.array([0.0, 1.0, 10.0, 100.0])
    means = lesson.means_of_draws(scores, 2, 500, rng)
    assert set((2 * means).round(6)) == {1.0, 10.0, 100.0, 11.0, 101.0, 110.0}
    assert np.allclose(lesson.means_of_draws(scores, 4, 5, rng), scores.mean())


def test_orders_are_written_from_the_highest_to_the_lowest():
    assert lesson.order_of({"a": 1.0, "b": 3.0, "c": 2.0}) == "b > c > a"
    assert lesson.order_of({"a": 1.0, "b": 1.0 + 1e-6, "c": 2.0}) == "c > b = a"


def test_shares_of_orders_add_up_and_agree_with_all_seeds(study):
    shares = lesson.orders_of_draws(study, 4, 2000)
    assert shares.sum() == pytest.approx(1)
    assert shares.index[0] == "uniform > effect > random"
    assert shares[shares.index.str.startswith("effect")].sum() < 0.02
    everything = lesson.orders_of_draws(study, 20, 10)
    assert everything.to_dict() == {"uniform > effect > random": 1.0}


def test_orders_are_drawn_with_their_shares(study):
    shares = lesson.orders_of_draws(study, 4, 500)
    figure = lesson.draw_orders(shares)
    assert "uniform > effect > random" in alt_text(figure)
    assert len(figure.axes[0].patches) == len(shares)


def test_no_uniform_run_is_like_their_mean(study):
    scores = study.scores("uniform")
    figure = lesson.draw_average_run(scores)
    assert "8 at 4" in alt_text(figure)
    assert not (abs(scores - scores.mean()) < 1).any()


def test_equal_scores_of_different_behaviour(study):
    figure = lesson.draw_episodes(study, "uniform", [0, 3])
    assert "Seed 0: return 4.0, up to step 7" in alt_text(figure)
    assert "Seed 3: return 4.0, up to step 15" in alt_text(figure)


def test_the_middle_half_is_half_of_the_runs(study):
    scores = study.scores("random")
    figure = lesson.draw_middle_half(scores, "random")
    filled = [bar for bar in figure.axes[0].patches if not bar.get_hatch()]
    assert len(filled) == 10
    assert f"interquartile mean {trim_mean(scores, 0.25):.2f}" in alt_text(figure)


def test_a_resample_is_counted():
    scores = np.array([1.0, 2.0, 6.0])
    figure = lesson.draw_resample(scores, np.array([0, 0, 2]))
    assert [bar.get_height() for bar in figure.axes[0].patches] == [2, 0, 1]
    assert "Mean of the runs 3.00, of the resample 2.67" in alt_text(figure)


@pytest.mark.parametrize("shown", [1, 39, 40, 500])
def test_resampled_means_get_their_interval_from_forty_on(shown):
    means = np.random.default_rng(0).normal(3, 1, 500)
    figure = lesson.draw_resampled(means, shown, 3.0)
    assert ("95 %" in alt_text(figure)) == (shown >= 40)
    assert sum(bar.get_height() for bar in figure.axes[0].patches) == shown


def test_intervals_hold_the_truth_as_often_as_they_say_only_with_many_seeds():
    scores = np.arange(20.0)
    few, many = lesson.coverage(scores, [3, 30], studies=300, resamples=299)
    assert few < 0.85
    assert many > 0.88


# Intervals, and what they decide


@pytest.mark.parametrize(
    ("found", "region", "said"),
    [
        (Estimate(1, 0.5, 2), (0, math.inf), "supported"),
        (Estimate(-1, -2, -0.5), (0, math.inf), "contradicted"),
        (Estimate(0, -1, 1), (0, math.inf), "undecided"),
        (Estimate(0, -0.5, 0.5), (-1, 1), "supported"),
        (Estimate(0, -3, 3), (-1, 1), "undecided"),
        (Estimate(4, 3, 5), (-1, 1), "contradicted"),
        (Estimate(4, math.nan, math.nan), (-1, 1), "undecided"),
    ],
)
def test_a_claim_is_judged_by_how_the_interval_lies_to_its_region(found, region, said):
    assert lesson.verdict(found, region) == said


def test_intervals_are_drawn_with_their_verdicts():
    found = {"up": Estimate(1, 0.5, 2), "few": Estimate(1, math.nan, math.nan)}
    figure = lesson.draw_intervals(found, "difference [reward]", dict.fromkeys(found, (0.0, math.inf)))
    assert "up 1.00 [0.50, 2.00], supported; few 1.00, undecided" in alt_text(figure)
    assert "undecided" in texts(figure)


def test_intervals_can_be_drawn_without_regions_and_without_a_mark():
    figure = lesson.draw_intervals({"a": Estimate(3000, 2000, 4000)}, "steps", mark=None)
    assert "a 3,000 [2,000, 4,000]" in alt_text(figure)


def test_pairs_are_counted_with_ties(study):
    figure = lesson.draw_pairs(np.array([3.0, 5.0]), np.array([1.0, 3.0, 4.0]), ("first", "second"))
    assert "2 times 3 pairs of runs: first higher 67 %; equal 17 %; second higher 17 %" in alt_text(figure)
    assert "effect-based higher" in alt_text(
        lesson.draw_pairs(study.scores("effect"), study.scores("random"), ("effect-based", "random"))
    )


# Set size, settings, trap


def test_set_sizes_are_named(study):
    assert "effect-based 7 to 18 motions; " in alt_text(lesson.draw_set_sizes(study))


@pytest.mark.parametrize(
    ("gap", "results"), [(7.0, ("stays below", "gains 1 step")), (1.0, ("stays below", "stays below"))]
)
def test_a_steep_jump_gets_out_of_a_gap_where_another_does_not(gap, results):
    words = alt_text(lesson.draw_gap_jumps(gap))
    assert f"At 85 degrees it {results[0]}; h / tan α is 26.2 mm" in words
    assert f"At 89 degrees it {results[1]}" in words


def test_one_angle_is_drawn_alone():
    assert len(lesson.draw_gap_jumps(angles=[88]).axes) == 1


def test_worlds_are_drawn_side_by_side(study):
    worlds = {"as recorded": study, "restitution 0": load_published_study("restitution-0")}
    figure = lesson.draw_worlds(worlds)
    assert len(figure.axes) == 2
    assert "restitution 0, uniform: mean 1.0 of 4 seeds" in alt_text(figure)


def test_worlds_with_scores_below_nought_are_drawn_whole(study):
    runs = study.runs.assign(score=study.runs["score"] - 6)
    figure = lesson.draw_worlds({"low": dataclasses.replace(study, runs=runs)})
    assert figure.axes[0].get_xlim()[0] < runs["score"][runs["method"].isin(lesson.SETS)].min()


# Jumps from treads


def measures(gaps, yaws=0.0, asides=0.0):
    """Return what was measured on rollouts in which cubes rest at these gaps."""
    gaps = np.asarray(gaps)
    flags, yaws, asides = np.zeros(len(gaps), bool), *np.broadcast_arrays(yaws, asides, gaps)[:2]
    happened = dict.fromkeys(("climbed", "fell", "left", "freed"), flags)
    return TreadMeasures(len(gaps), 1, gaps, yaws, asides, np.zeros((len(gaps), 2)), tops=np.zeros(1, int), **happened)


def test_the_rollout_of_the_lesson_is_that_of_the_library():
    lesson_10 = nbformat.read(PROJECT / "notebooks" / "10_does_it_hold_up.ipynb", as_version=4)
    (source,) = (cell.source for cell in lesson_10.cells if cell.id == "10-rollouts")
    names: dict = {}
    exec(source.split("\n\n\n")[0], names)  # the function that the cell defines
    world, (seed,) = StairWorld(Staircase.fifteen()), np.random.SeedSequence(3).spawn(1)
    jumps, made = names["rollout"](world, np.random.default_rng(seed)), roll_out(world, 1, seed=3, progress=False)
    np.testing.assert_array_equal([jump.end[:7] for jump in jumps], made.ends)


def test_resting_cubes_are_drawn_where_they_lie():
    rest = measures([0.01, 0.1], [0.0, 45.0], [0.0, 0.2])
    figure = lesson.draw_resting({"here": rest, "there": rest}, shown=1)
    assert "there: in the median 55 mm before it, turned by 22 degrees, 10 cm aside" in alt_text(figure)
    (cube,) = figure.axes[0].patches
    assert cube.get_xy().max(axis=0) == pytest.approx([-0.01, 0.05])
    turned = lesson.draw_resting({"turned": measures([0.1], 45.0, 0.2)}).axes[0].patches[0].get_xy()
    assert turned.max(axis=0) == pytest.approx([-0.1, 0.2 + 0.05 * 2**0.5])


def test_gaps_on_treads_are_told_beside_the_engines():
    figure = lesson.draw_tread_gaps({"plane": measures([0.001, 0.002, 0.01, 0.2])})
    assert "plane: 75 % within 30 mm, median 6 mm" in alt_text(figure)
    assert "engine: median 71 mm" in alt_text(figure)


@pytest.mark.parametrize("world", [StairWorld(Staircase.fifteen()), TumblingWorld(Staircase.fifteen())])
def test_nothing_climbs_from_the_trap_and_all_from_far_in_either_world(world):
    near, far = lesson.climb_chances(world, [0.02, 0.25], 12)
    assert (near, far) == (0, 1)
    assert list(world.state) == list(world.start)


def test_a_turned_cube_climbs_from_its_foremost_corner_on():
    world = TumblingWorld(Staircase.fifteen())
    assert lesson.climb_chances(world, [0.02, 0.25], 12, yaw=30).tolist() == [0, 1]
    with pytest.raises(ValueError, match="rotates about x"):
        lesson.climb_chances(StairWorld(Staircase.fifteen()), [0.02], 1, yaw=30)


def test_chances_are_drawn_and_compared():
    figure = lesson.draw_climb_chances([0.01, 0.1], {"a": np.array([0.0, 0.5]), "b": np.array([0.0, 1.0])}, 20)
    assert "a: 10 mm 0 %, 100 mm 50 %" in alt_text(figure)
    assert lesson.easier(np.array([0.1, 0.5]), np.array([0.1, 0.6])) == "about alike"
    assert lesson.easier(np.array([0.1, 0.5]), np.array([0.5, 0.9])) == "in the tumbling world"
    assert lesson.easier(np.array([0.9, 0.5]), np.array([0.5, 0.1])) == "in the plane"


# The study in three dimensions: here the plane's, under another name


def in_three_dimensions(study, shift=0.0, **settings):
    """Return a study as if it had been made in the tumbling world, with other scores of the effect-based sets."""
    runs = study.runs.assign(score=study.runs["score"] + shift * (study.runs["method"] == "effect"))
    description = study.description | {"settings": study.description["settings"] | {"world": "tumbling"} | settings}
    return dataclasses.replace(study, runs=runs, description=description)


def test_controls_set_what_should_be_beside_what_is(study):
    tumbling, published = load_published_study("tumbling"), load_published_study("tumbling-as-published")
    table = lesson.controls(tumbling, published).set_index("control")["is"]
    assert f"mean {tumbling.scores('sac').mean():.1f} [" in table["SAC, which may use any motion"]
    assert f"mean {published.scores('authors').mean():.1f} [" in table["the authors' own 17 motions, their readings"]
    assert f"mean {published.scores('uniform').mean():.1f} [" in table["the grid, their readings"]
    assert table["best return that a search finds for uniform"] == "15.0 on average"


def test_accounts_show_what_is_earned_and_lost_in_each_world(study):
    tumbling = load_published_study("tumbling")
    figure = lesson.draw_accounts({"plane": study, "3-D": tumbling})
    assert len(figure.axes[0].patches) == 12
    row = tumbling.accounts().set_index("method").loc["uniform"]
    words = f"earns {row['climb']:.1f}, loses {-row['lost']:.1f}, {row['steps a climb']:.1f} steps a climb"
    assert f"uniform, 3-D: {words}" in alt_text(figure)


# What the lesson states of the plane


def test_the_numbers_that_the_lesson_states_are_so(study):
    effect, uniform, random = (study.scores(method) for method in lesson.SETS)
    assert f"{effect.mean():.1f}" == "3.3"
    assert sorted(random)[-2:] == pytest.approx([5, 15], abs=0.01)
    assert (abs(uniform - 4) < 0.01).sum() == 8
    assert 5.5 < uniform.mean() - effect.mean() < 6.5
    rng = np.random.default_rng(4)
    first, second = (lesson.means_of_draws(scores, 4, 10_000, rng) for scores in (effect, uniform))
    assert (first > second).mean() < 1 / 200
    assert study.difference("uniform-matched", "effect").low > 0
    assert load_published_study("beyond").difference("uniform", "effect").low > 0
    flush, bouncing = (load_published_study(f"restitution-{value}") for value in ("0", "0.1"))
    assert flush.scores("uniform").mean() < min(flush.scores(method).mean() for method in ("effect", "random"))
    assert bouncing.scores("uniform").mean() > max(bouncing.scores(method).mean() for method in ("effect", "random"))
    assert study.scores("sac").mean() == pytest.approx(7.2, abs=0.05)


def test_the_widths_of_intervals_that_the_lesson_states_are_so(study):
    shares = {method: lesson.coverage(study.scores(method), [4], 600, 599)[0] for method in lesson.SETS}
    assert min(shares.values()) > 0.6
    assert max(shares.values()) < 0.85


def test_evaluations_make_an_interval_half_as_wide_as_seeds_and_decide_what_they_should_not(study):
    last = study.evaluations.groupby(["method", "seed"]).tail(5)
    evaluations = {method: rows["return"].to_numpy() for method, rows in last.groupby("method")}
    seeds, wrong = estimate(np.mean, study.scores("effect")), estimate(np.mean, evaluations["effect"])
    assert 0.4 < (wrong.high - wrong.low) / (seeds.high - seeds.low) < 0.7
    assert study.difference("uniform", "uniform-matched").low < 0
    assert (
        estimate(
            lambda x, y, axis: x.mean(axis) - y.mean(axis), evaluations["uniform"], evaluations["uniform-matched"]
        ).low
        > 0
    )
