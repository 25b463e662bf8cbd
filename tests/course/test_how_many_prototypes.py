"""The pictures of lesson 05, and the steps of equations 2 and 3 that they show."""

import warnings

import numpy as np
import pytest
from matplotlib.figure import Figure

from stairlab import EffectClasses, StairWorld, alt_text, prototype_counts, sample_motions
from stairlab.course import explore
from stairlab.course import how_many_prototypes as lesson
from stairlab.drawing import png


@pytest.fixture(scope="module")
def classes() -> EffectClasses:
    """Return six classes of 600 jumps."""
    return EffectClasses.from_samples(sample_motions(StairWorld(), n=600, seed=0, progress=False), k_range=(6, 6))


@pytest.fixture(scope="module")
def sums(classes) -> tuple[np.ndarray, np.ndarray]:
    return classes.means.sum(axis=1), classes.stds.sum(axis=1)


def drawn(figure: Figure) -> str:
    assert png(figure, dpi=40).startswith(b"\x89PNG")
    for ax in figure.axes[:2]:
        assert ax.get_ylabel()
    assert not set("$\\") & set(alt_text(figure))
    return alt_text(figure)


def test_the_steps_are_those_of_the_library(classes, sums):
    counts, steps = prototype_counts(classes), lesson.stages_of(*sums)
    assert list(steps) == list(lesson.STAGES)
    np.testing.assert_array_equal(steps["count"], counts["xi"])
    np.testing.assert_allclose(steps["cv"], counts["cv"])
    np.testing.assert_allclose(steps["ratio"], counts["weight"] / counts["weight"].min())


def test_the_published_classes_get_one_and_four():
    steps = lesson.stages_of(lesson.PUBLISHED_MEANS, lesson.PUBLISHED_STDS)
    assert steps["count"].tolist() == [1, 1, 4, 4, 4, 4]


def test_a_class_as_it_is_changes_nothing(classes):
    counts = lesson.counts_if(classes, 3)
    np.testing.assert_array_equal(counts["xi"], prototype_counts(classes)["xi"])


def test_a_smaller_minimum_raises_the_counts_of_others_and_what_was_given_stays(classes):
    smallest = int(prototype_counts(classes)["weight"].idxmin())
    before = classes.stds.copy()
    changed = lesson.counts_if(classes, smallest, mean=0.1, spread=0.1)
    assert (changed["xi"].drop(smallest) > prototype_counts(classes)["xi"].drop(smallest)).all()
    np.testing.assert_array_equal(classes.stds, before)


def test_odd_classes_are_counted_without_a_warning(classes):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        counts = lesson.counts_if(classes, 1, mean=0.1, spread=3.0)
    assert counts["cv"][1] == pytest.approx(0.999999)


def test_resamples_scatter_about_the_measured_steps_and_are_repeatable(classes, sums):
    again = lesson.resampled_stages(classes, repeats=40, seed=1)
    assert again["count"].shape == (40, 6)
    np.testing.assert_allclose(again["mean"].mean(axis=0), sums[0], rtol=0.1)
    np.testing.assert_array_equal(again["ratio"], lesson.resampled_stages(classes, repeats=40, seed=1)["ratio"])


def test_shares_kept_under_noise_are_shares_and_repeatable(classes):
    kept = lesson.kept_under_noise(StairWorld(), classes, motions=6, replays=2)
    assert kept.shape == (6,)
    assert ((kept >= 0) & (kept <= 1)).all()
    np.testing.assert_array_equal(kept, lesson.kept_under_noise(StairWorld(), classes, motions=6, replays=2))


def test_effects_are_drawn_with_mean_and_spread(classes):
    figure = lesson.plot_effects_by_class(classes)
    assert f"C3: dy {classes.means[2, 0]:.2f} ± {classes.stds[2, 0]:.3f} m" in drawn(figure)
    assert len(figure.axes) == 2
    assert len(lesson.plot_effects_by_class(classes, ["dy"]).axes) == 1


@pytest.mark.parametrize(
    ("values", "style"),
    [
        ({"xi": [1, 4, 3]}, {"digits": 0}),
        ({"xi": [1, -4, 3]}, {"digits": 0}),
        ({"std": [1e-8, 4, 3]}, {"log": True, "numbers": [2, 3, 4]}),
        ({"one": [1, 2, 3], "other": [3, 2, 1]}, {}),
        ({"one": [1, 2, 3], "other": [3, 2, 1]}, {"stacked": True}),
    ],
)
def test_bars_are_drawn_and_told(values, style):
    figure = lesson.plot_bars(values, "something $\\mu$ [m]", **style)
    assert "something μ [m]" in drawn(figure)
    assert len(figure.axes[0].patches) == 3 * len(values)
    assert (figure.axes[0].get_legend() is not None) == (len(values) > 1)


@pytest.mark.parametrize("stage", lesson.STAGES)
def test_each_step_has_a_picture(sums, stage):
    assert stage in drawn(lesson.plot_stage(lesson.stages_of(*sums), stage))


@pytest.mark.parametrize("show", ["cv", "weight"])
def test_classes_are_drawn_in_the_plane_of_mean_and_spread(sums, show):
    assert "C6: mean" in drawn(lesson.plot_mean_and_spread(*sums, show))


def test_a_class_with_a_negative_mean_has_its_place(sums):
    figure = lesson.plot_mean_and_spread([-1.0, 0.1, 2.0], [0.4, 0.2, 0.3], "weight")
    assert figure.axes[0].get_xlim()[0] < -1
    assert "C1: mean -1.00" in drawn(figure)


def test_sensitivity_draws_a_line_for_each_class(classes):
    figure = lesson.plot_sensitivity(classes, 2, [0.5, 1.0, 1.5])
    assert "spread of C2" in drawn(figure)
    assert len(figure.axes[0].get_legend().get_texts()) == 6


def test_resampled_counts_are_shown_with_their_shares():
    counts = np.array([[1, 4], [1, 5], [1, 4], [1, 4]])
    words = drawn(lesson.plot_resampled_counts(counts, [1, 4]))
    assert "C2: 4 in 75 %, 5 in 25 %" in words


def test_ratios_are_drawn_with_and_without_a_range(sums):
    ratio = lesson.stages_of(*sums)["ratio"]
    assert "once: 1.0" in drawn(lesson.plot_ratios({"once": ratio}))
    assert "again: 1.0" in drawn(lesson.plot_ratios({"once": ratio, "again": np.array([ratio, 1.1 * ratio])}))


def test_reliability_is_drawn_against_cv():
    assert "C2: cv 0.05, kept 80 %" in drawn(lesson.plot_against_cv(np.array([0.6, 0.05]), np.array([0.9, 0.8])))


@pytest.mark.parametrize("number", [1, 6])
@pytest.mark.parametrize(("mean", "spread"), [(1.0, 1.0), (0.1, 3.0), (3.0, 0.1), (0.1, 0.1), (3.0, 3.0)])
def test_the_widget_shows_all_counts_at_the_edges_of_its_sliders(classes, number, mean, spread):
    counts = lesson.counts_if(classes, number, mean, spread)
    words = drawn(lesson.draw_counts_if(classes, number, mean, spread))
    assert words.startswith(f"C{number} with {mean:g} times its mean and {spread:g} times its spread")
    assert f"C6 {prototype_counts(classes)['xi'][6]} to {counts['xi'][6]}" in words


def test_the_widget_can_be_explored(classes):
    def what_if(number=2, mean=1.0, spread=1.0):
        return lesson.draw_counts_if(classes, number, mean, spread)

    exploration = explore(what_if, number=list(classes.numbers), mean=[0.5, 1.0], spread=[1.0, 2.0])
    assert exploration.widget().children[-1].value.startswith("<img")
