"""The pictures of lesson 04, and its choices to be explored."""

import re

import numpy as np
import pytest
from sklearn import metrics

from stairlab import EffectClasses, StairWorld, alt_text, sample_motions, silhouette_samples
from stairlab.course import explore
from stairlab.course.how_many_classes import (
    KS,
    ClassChoices,
    best_k,
    draw_a_and_b,
    draw_drift,
    draw_grid,
    draw_neighbours,
    draw_pair,
    draw_scores,
    draw_silhouette_map,
    draw_silhouettes,
    draw_stretched,
    draw_votes,
    height_levels,
    labels_by_k,
)
from stairlab.drawing import png
from stairlab.sampling import Samples


@pytest.fixture(scope="module")
def some() -> Samples:
    """Return 200 jumps with x drift."""
    return sample_motions(StairWorld(x_drift=True), n=200, seed=0, progress=False)


@pytest.fixture(scope="module")
def with_x(some) -> np.ndarray:
    return some.on_the_map().effect("dx", "dy", "dz")


@pytest.fixture(scope="module")
def effects(with_x) -> np.ndarray:
    return with_x[:, 1:]


@pytest.fixture(scope="module")
def labels(effects) -> dict[int, np.ndarray]:
    return labels_by_k(effects)


def test_classes_are_numbered_by_the_length_of_their_mean(effects, labels):
    assert list(labels) == list(KS)
    for k, each in labels.items():
        lengths = [np.linalg.norm(effects[each == c].mean(axis=0)) for c in range(k)]
        assert lengths == sorted(lengths)


def test_the_first_best_k_of_a_range_wins():
    assert best_k([0.9, 0.5, 0.8, 0.8], range(2, 6)) == 2
    assert best_k([0.9, 0.5, 0.8, 0.8], range(2, 6), 3, 5) == 4


def test_a_b_and_s_of_a_sample_are_told(effects, labels):
    figure = draw_neighbours(effects, labels[6], 7)
    silhouette = silhouette_samples(effects, labels[6])[7]
    assert f"s = {silhouette:.2f}" in alt_text(figure)
    assert len(figure.axes[1].patches) == 6


def test_a_sample_that_is_alone_can_be_drawn(effects):
    labels = np.append(np.zeros(len(effects) - 1, int), 1)
    assert png(draw_neighbours(effects, labels, len(effects) - 1))


@pytest.mark.parametrize("k", [2, 6, 10])
def test_silhouettes_have_their_mean(effects, labels, k):
    figure = draw_silhouettes(effects, labels[k], "a title")
    mean = metrics.silhouette_score(effects, labels[k])
    assert alt_text(figure).startswith(f"Silhouettes by class, a title, mean {mean:.3f}. C1: ")
    assert len(figure.axes[0].collections) == k


def test_the_map_names_the_lowest_silhouette(effects, labels):
    lowest = silhouette_samples(effects, labels[6]).min()
    assert f"from {lowest:.2f} to" in alt_text(draw_silhouette_map(effects, labels[6], "six"))


def test_what_the_heights_give_adds_up_to_the_difference_of_the_scores(effects, labels):
    told = re.search(r"k = 6: (.*?)(;|\.$)", alt_text(draw_votes(effects, labels)))
    gains = [float(word.split()[-1]) for word in told[1].split(", ")]
    scores = {k: metrics.silhouette_score(effects, labels[k]) for k in (2, 6)}
    assert sum(gains) == pytest.approx(scores[6] - scores[2], abs=0.004)
    assert len(gains) == 5


def test_heights_are_steps_gained(effects):
    np.testing.assert_array_equal(height_levels(np.array([[0.1, 0.0], [0.5, 0.2999], [1.0, 1.2]])), [0, 1, 4])


def test_a_curve_names_its_scores_and_rings():
    figure = draw_scores({"one": [0.1, 0.3], "other": [0.2, 0.2]}, "a score", {5: "here", 4: ""}, ks=[4, 5])
    words = "a score by number of classes: one 4: 0.100, 5: 0.300; other 4: 0.200, 5: 0.200."
    assert alt_text(figure) == f"{words} Ringed: k = 5, here. Ringed: k = 4."


def test_a_table_leaves_out_what_is_not_there():
    table = np.array([[np.nan, 2.0], [3.0, np.nan]])
    figure = draw_grid(table, ["a", "b"], ["c", "d"], ("rows", "columns"), "{:.1f}", [(0, 1)], "a title")
    assert alt_text(figure) == "a title, in a table: rows against columns. a: d 2.0; b: c 3.0."
    assert png(figure)
    assert png(draw_grid([[6, 6]], ["a"], ["c", "d"], ("rows", "columns")))


def test_the_ratio_of_two_classes_is_told(effects, labels):
    of_two = np.isin(labels[6], (2, 3))
    index = metrics.davies_bouldin_score(effects[of_two], labels[6][of_two])
    assert f"ratio {index:.2f}." in alt_text(draw_pair(effects, labels[6], 2, 3))


@pytest.mark.parametrize("factor", [0.1, 4.0])
def test_a_stretched_height_can_be_drawn(effects, factor):
    figure = draw_stretched(effects, factor)
    assert f"dz counts {factor:g} times: six classes" in alt_text(figure)
    assert "best of 3 to 6" in figure.axes[1].get_title(loc="left")


def test_the_drift_of_each_class_is_told(with_x, labels):
    figure = draw_drift(with_x, labels[6], "from above")
    assert sum(len(drawn.get_offsets()) for drawn in figure.axes[0].collections) == len(with_x)
    assert f"C3 {with_x[labels[6] == 2, 0].std():.3f} m" in alt_text(figure)


def test_a_and_b_make_the_silhouettes(effects, with_x, labels):
    words = alt_text(draw_a_and_b({"yz": effects, "xyz": with_x}, labels[2]))
    told = re.findall(r"C\d (\S+) and (\S+) m", words)
    assert len(told) == 4
    assert all(0 < float(a) < float(b) for a, b in told)


def test_a_choice_is_what_algorithm_2_finds(some):
    choices = ClassChoices(some)
    for preset, ranged in (
        ("paper-figures", (3, 6, "silhouette")),
        ("released-code", (3, 10, "davies-bouldin", "max-abs")),
    ):
        assert choices.chosen(*ranged) == EffectClasses.from_samples(some, preset=preset).n_classes


@pytest.mark.parametrize("k", [2, 10])
@pytest.mark.parametrize("criterion", ClassChoices.CRITERIA)
@pytest.mark.parametrize("scaling", ClassChoices.SCALINGS)
@pytest.mark.parametrize("features", ClassChoices.FEATURES)
def test_the_edges_of_the_controls_can_be_drawn(some, k, criterion, scaling, features):
    figure = ClassChoices(some).draw(k, criterion, scaling, features)
    assert f"{features}, scaling {scaling}, {criterion}: of 2 to 10 it picks" in alt_text(figure)
    assert f"{k} classes on ({features})" in alt_text(figure)


def test_a_moved_control_shows_other_classes(some):
    choices = ClassChoices(some)
    exploration = explore(choices.draw, k=list(KS), criterion=choices.CRITERIA, features=choices.FEATURES)
    k, criterion, features, picture = exploration.widget().children
    assert "6 classes on (dy, dz)" in picture.value
    k.value, features.value, criterion.value = 3, "dx, dy, dz", "davies-bouldin"
    assert "3 classes on (dx, dy, dz)" in picture.value
    assert "Davies-Bouldin" in picture.value
