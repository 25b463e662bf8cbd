"""Lesson 10: what its pictures show, at their defaults and at the edges of their controls, and that its small models are right."""

import math

import numpy as np
import pandas as pd
import pytest
from scipy.stats import trim_mean

from stairlab import Staircase, StairWorld, alt_text, load_published_study, paper_claims, sample_motions
from stairlab.course import does_it_hold_up as lesson
from stairlab.course import explore
from stairlab.estimates import Estimate, estimate
from stairlab.fidelity import riser_gaps


@pytest.fixture(scope="module")
def study():
    return load_published_study()


def texts(figure):
    """Return all words that are written in a figure."""
    words = [text.get_text() for ax in figure.axes for text in (*ax.texts, ax.title, ax.xaxis.label, ax.yaxis.label)]
    words += [ax.get_title(loc) for ax in figure.axes for loc in ("left", "right")]
    return " ".join(words + [tick.get_text() for ax in figure.axes for tick in ax.get_yticklabels()])


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


def test_one_run_moves_the_mean_and_hardly_the_middle_half(study):
    figure = lesson.draw_outlier(study.scores("random"), "random")
    mean, median, middle = (line.get_ydata() for line in figure.axes[0].lines)
    assert np.ptp(mean) == pytest.approx(15 / 20, abs=1e-4)
    assert np.ptp(middle) < 0.3
    assert np.ptp(median) < 0.5
    assert "mean by 0.75" in alt_text(figure)


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
        (Estimate(1, 0.5, 2), (0, math.inf), "holds"),
        (Estimate(-1, -2, -0.5), (0, math.inf), "holds not"),
        (Estimate(0, -1, 1), (0, math.inf), "not decided"),
        (Estimate(0, -0.5, 0.5), (-1, 1), "holds"),
        (Estimate(0, -3, 3), (-1, 1), "not decided"),
        (Estimate(4, 3, 5), (-1, 1), "holds not"),
        (Estimate(4, math.nan, math.nan), (-1, 1), "not decided"),
    ],
)
def test_a_claim_is_judged_by_how_the_interval_lies_to_its_region(found, region, said):
    assert lesson.verdict(found, region) == said


def test_intervals_are_drawn_with_their_verdicts():
    found = {"up": Estimate(1, 0.5, 2), "few": Estimate(1, math.nan, math.nan)}
    figure = lesson.draw_intervals(found, "difference [reward]", dict.fromkeys(found, (0.0, math.inf)))
    assert "up 1.00 [0.50, 2.00], holds; few 1.00, not decided" in alt_text(figure)
    assert "not decided" in texts(figure)


def test_intervals_can_be_drawn_without_regions_and_without_a_mark():
    figure = lesson.draw_intervals({"a": Estimate(3000, 2000, 4000)}, "steps", mark=None)
    assert "a 3,000 [2,000, 4,000]" in alt_text(figure)


def test_the_drawn_claims_have_the_verdicts_of_the_table(study):
    table = paper_claims(study)["verdict"].tolist()
    drawn = [lesson.verdict(*one) for rows in lesson.claim_intervals(study).values() for one in rows.values()]
    assert drawn[:5] == table[:5]  # means, maxima, "close"
    assert drawn[7:] == table[5:8]  # convergence
    assert set(drawn[5:7]) == {"holds", "not decided"}  # of the spreads, both are needed
    assert "mean: effect above uniform" in alt_text(lesson.draw_claims(study))


def test_pairs_are_counted_with_ties(study):
    figure = lesson.draw_pairs(np.array([3.0, 5.0]), np.array([1.0, 3.0, 4.0]), ("first", "second"))
    assert "2 times 3 pairs of runs: first higher 67 %; equal 17 %; second higher 17 %" in alt_text(figure)
    assert "effect-based higher" in alt_text(
        lesson.draw_pairs(study.scores("effect"), study.scores("random"), ("effect-based", "random"))
    )


# Set size, trap, simulator


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


def test_traps_lie_along_the_steepness_and_endless_ones_are_left_out():
    traps = pd.DataFrame(
        {"method": ["effect", "effect", "random"], "trap": [0.02, math.inf, 0.04], "steepest": [85.0, 60, 80]}
    )
    assert "of 2 sets" in alt_text(lesson.draw_steepness(traps))


def test_a_change_of_traps_is_told_by_medians():
    figure = lesson.draw_with_one_more([0.02, 0.03, 0.04], [0.004, 0.004, 0.005], ("before", "after"))
    assert "before, median 30.0 mm; after, median 4.0 mm" in alt_text(figure)


def test_gaps_are_told_by_shares():
    stairs = Staircase()
    gaps = {
        "here": riser_gaps(sample_motions(StairWorld(stairs), 30, seed=0, progress=False), stairs),
        "flush": np.zeros(4),
    }
    figure = lesson.draw_gap_shares(gaps, {"a": 0.004, "b": 0.02}, np.array([0.001, 0.01]))
    assert "flush: 100 % nearer than a" in alt_text(figure)
    assert "Of 2 stuck agents, 1 stand between" in alt_text(figure)


def test_worlds_are_drawn_side_by_side(study):
    worlds = {"as recorded": study, "restitution 0": load_published_study("restitution-0")}
    figure = lesson.draw_worlds(worlds)
    assert len(figure.axes) == 2
    assert "restitution 0, uniform: mean 1.0 of 4 seeds" in alt_text(figure)


def test_the_numbers_that_the_lesson_states_are_so(study):
    effect, uniform, random = (study.scores(method) for method in lesson.SETS)
    assert f"{effect.mean():.1f}" == "3.3"
    assert sorted(random)[-2:] == pytest.approx([5, 15], abs=0.01)
    assert (abs(uniform - 4) < 0.01).sum() == 8
    needed = (2.8 / (effect.mean() - random.mean())) ** 2 * (effect.var(ddof=1) + random.var(ddof=1))
    assert 400 < needed < 500
    assert paper_claims(study)["verdict"].value_counts().to_dict() == {"not decided": 8, "holds not": 6, "holds": 1}
    stuck = study.ends().query("method == 'effect' and end == 'stuck'")["to riser"]
    assert (len(stuck), stuck.median()) == (11, pytest.approx(0.007, abs=0.0005))
    assert not load_published_study("restitution-0").scores("uniform").max() > uniform.min()
    beyond = load_published_study("beyond").difference("along-stairs", "uniform")
    assert beyond.low < 0 < beyond.high


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
