"""What follows from a study's tables: against NumPy and counting by hand."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from small_study import STEPS, made_up

from stairlab.results import StudyResults

rng = np.random.default_rng(0)
HIGH, LOW = rng.normal(10, 1, 20), rng.normal(5, 1, 20)


def test_a_curve_that_rises_evenly_is_half_way_after_half_of_its_rise():
    results = made_up({"effect": HIGH, "uniform": LOW}, samples={"effect": 2000})
    rise = [min(i / (len(STEPS) - 5), 1.0) for i in range(1, len(STEPS) + 1)]
    half_way = next(step for step, share in zip(STEPS, rise, strict=True) if share >= (rise[0] + 1) / 2)
    for method in ("effect", "uniform"):
        assert results.steps_to_half(method).value == pytest.approx(half_way, abs=500)  # one evaluation, by rounding
    assert results.difference("effect", "uniform", "half at").value == pytest.approx(0, abs=500)
    assert results.shift("effect") == 2000


def test_two_methods_are_compared_by_score_spread_and_peak():
    results = made_up({"effect": HIGH, "uniform": 2 * LOW})
    assert results.difference("effect", "uniform").value == pytest.approx(HIGH.mean() - 2 * LOW.mean())
    assert results.difference("effect", "uniform", "spread").value == pytest.approx(
        HIGH.std(ddof=1) - 2 * LOW.std(ddof=1)
    )
    assert results.difference("effect", "uniform", "peak").value == pytest.approx(HIGH.mean() - 2 * LOW.mean())
    with pytest.raises(ValueError, match="of must be one of 'score', 'spread', 'half at', 'peak'"):
        results.difference("effect", "uniform", "speed")


@pytest.mark.parametrize("of", ["score", "spread", "half at", "peak"])
def test_a_p_value_is_below_005_where_the_interval_excludes_the_bound(of):
    results = made_up({"effect": HIGH, "uniform": LOW + rng.normal(0, 2, 20)})
    found = results.difference("effect", "uniform", of)
    for bound, excluded in ((found.low - 1e-6, True), (found.high + 1e-6, True), ((found.low + found.high) / 2, False)):
        assert (results.p_value("effect", "uniform", of, bound) < 0.051) == excluded


def test_another_method_stands_in_for_the_effect_based_sets():
    results = made_up({"effect": LOW, "mine": HIGH, "uniform": LOW})
    turned = results.with_effect_sets("mine")
    assert turned.methods == ["effect", "uniform"]
    np.testing.assert_array_equal(turned.scores("effect"), results.scores("mine"))
    assert set(turned.episodes["method"]) == {"effect", "uniform"}
    np.testing.assert_array_equal(results.with_effect_sets("effect").scores("effect"), LOW)


def test_a_curve_that_never_rises_counts_as_risen_at_the_end():
    assert made_up({"effect": [0.0] * 6}).steps_to_half("effect").value == STEPS[-1]
    assert made_up({"effect": [-2.0] * 6}).steps_to_half("effect").value == STEPS[-1]


def test_a_return_is_reached_at_a_step_or_never():
    results = made_up({"effect": [10.0] * 6})
    assert results.step_of("effect", 10.0) == STEPS[len(STEPS) - 6]
    assert results.step_of("effect", 10.1) == np.inf


def test_the_summary_has_a_row_for_each_method_in_order():
    table = made_up({"uniform": LOW, "effect": np.append(HIGH, 15.0), "sac": [1.0, 2.0]}).summary()
    assert table["method"].tolist() == ["uniform", "effect", "sac"]
    assert table["seeds"].tolist() == [20, 21, 2]
    assert table["mean"].tolist() == pytest.approx([LOW.mean(), np.append(HIGH, 15).mean(), 1.5])
    assert table["sd"][0] == pytest.approx(LOW.std(ddof=1))
    assert table["at the top"].tolist() == pytest.approx([0, 1 / 21, 0])
    assert table["best return"][:2].tolist() == [12, 12]
    assert table[["best return", "allow 15", "proved", "low"]].iloc[2].isna().all()


def test_a_study_is_saved_and_loaded_to_the_digit(tmp_path):
    results = made_up({"effect": HIGH, "sac": LOW})
    results.save_tables(tmp_path / "study")
    again = StudyResults.load(tmp_path / "study")
    for name in ("runs", "evaluations", "motions", "episodes"):
        written = getattr(results, name).round({"return": 4})
        pd.testing.assert_frame_equal(getattr(again, name), written, check_exact=True, check_dtype=False)
    assert again.description == results.description
    written = replace(results, evaluations=results.evaluations.round({"return": 4}))
    pd.testing.assert_frame_equal(again.summary(), written.summary())


def test_the_command_repeats_the_study():
    assert made_up({"effect": HIGH[:3], "uniform": LOW[:3], "sac": LOW[:1]}).command() == (
        "stairlab study --timesteps 30000 --world plane --methods effect uniform --seeds 0-2\n"
        "stairlab study --timesteps 30000 --world plane --methods sac --seeds 0"
    )
    quick = made_up({"effect": HIGH[:1]}, quick=True)
    assert quick.command() == "stairlab study --quick --world plane --methods effect --seeds 0"


def test_the_command_names_what_differs_from_the_default():
    results = made_up({"effect": HIGH[:1]})
    results.description["settings"] |= {"world": "tumbling", "rocking": 0.5, "friction": 0.8, "as_published": True}
    assert results.command() == (
        "stairlab study --timesteps 30000 --world tumbling --rocking 0.5 --friction 0.8 --as-published --methods effect --seeds 0"
    )


def test_results_are_selected_and_joined_in_the_order_of_a_study():
    whole = made_up({"effect": HIGH[:4], "uniform": LOW[:4]})
    first, second = whole.selected(["effect", "uniform"], [0, 2]), whole.selected(["uniform", "effect"], [1, 2, 3])
    assert len(first.runs) == 4
    again = second.joined(first)
    for name in ("runs", "evaluations", "motions", "episodes"):
        pd.testing.assert_frame_equal(getattr(again, name), getattr(whole, name))


def test_the_motions_of_a_set_that_is_not_ours_to_hand_on_can_be_left_out():
    results = made_up({"effect": HIGH[:1], "theirs": LOW[:1]}).without_motions_of(["theirs"])
    assert set(results.motions["method"]) == {"effect"}
    hidden = results.episodes["method"] == "theirs"
    assert results.episodes.loc[hidden, ["magnitude", "angle"]].isna().all(axis=None)
    assert results.episodes.loc[~hidden, ["magnitude", "angle"]].notna().all(axis=None)
    assert results.scores("theirs") == LOW[:1]


def test_a_folder_without_a_study_or_with_damaged_tables_is_refused(tmp_path):
    with pytest.raises(ValueError, match="folder must hold a study"):
        StudyResults.from_folder(tmp_path)
    made_up({"effect": HIGH[:2]}).save_tables(tmp_path)
    (tmp_path / "description.json").write_text("{")
    with pytest.raises(ValueError, match=r"description\.json must be a file of a study's tables"):
        StudyResults.load(tmp_path)
    (tmp_path / "motions.csv").write_bytes(b"")
    with pytest.raises(ValueError, match=r"motions\.csv must be"):
        StudyResults.load(tmp_path)


def test_unknown_methods_and_empty_studies_are_refused():
    with pytest.raises(ValueError, match="method must be one of 'effect', not 'effects'"):
        made_up({"effect": HIGH}).scores("effects")
    with pytest.raises(ValueError, match="run the study first"):
        StudyResults.from_runs([], {"settings": {}, "own": {}})
