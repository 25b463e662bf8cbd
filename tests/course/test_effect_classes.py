"""The pictures of lesson 03, and the centres that are moved by hand."""

import re

import numpy as np
import pytest
from matplotlib.collections import PathCollection

from stairlab import KMeans, StairWorld, alt_text, new_figure, sample_motions
from stairlab.course.effect_classes import (
    STARTS,
    TURNS,
    draw_agreement,
    draw_bins,
    draw_distances,
    draw_effects,
    draw_far_samples,
    draw_inertias,
    draw_turn,
    inertia,
    move_centers,
    spread,
    turns_from,
)
from stairlab.drawing import png

CENTERS = np.array([[0.2, 0.2], [0.3, 0.5], [0.4, 0.8]])


@pytest.fixture(scope="module")
def effects() -> np.ndarray:
    """Return the effects of 150 jumps, dy and dz."""
    return sample_motions(StairWorld(), n=150, seed=0, progress=False).on_the_map().effect("dy", "dz")


def marks(ax) -> int:
    return sum(len(drawn.get_offsets()) for drawn in ax.collections if isinstance(drawn, PathCollection))


def test_effects_are_drawn_where_they_are_up_to_three_centimetres(effects):
    assert np.abs(spread(effects) - effects).max(axis=0) == pytest.approx([0, 0.03], abs=0.002)
    np.testing.assert_array_equal(spread(effects), spread(effects))


def test_the_plane_shows_every_effect(effects):
    figure = draw_effects(effects)
    assert marks(figure.axes[0]) == len(effects)
    assert f"{len(effects)} effects" in alt_text(figure)


def test_classes_centres_and_regions_are_shown_and_told(effects):
    labels = KMeans(3, random_state=0).fit(effects).labels_
    figure = draw_effects(effects, labels, CENTERS, before=CENTERS[::-1], regions=True, chosen=0, title="a title")
    assert marks(figure.axes[0]) == len(effects)
    assert len(figure.axes[0].images) == 1
    sizes = ", ".join(map(str, np.bincount(labels)))
    assert alt_text(figure).startswith("a title.")
    assert f"Classes of {sizes} samples. Centres at (0.20, 0.20)" in alt_text(figure)
    assert png(figure)


def test_a_region_has_the_look_of_its_nearest_centre(effects):
    ax = draw_effects(effects, centers=CENTERS, regions=True).axes[0]
    drawn = ax.images[0]
    left, right, low, high = drawn.get_extent()
    rows, columns = drawn.get_array().shape
    for row, column in ((5, 5), (100, 40), (rows - 1, columns - 1)):
        place = left + (column + 0.5) * (right - left) / columns, low + (row + 0.5) * (high - low) / rows
        assert drawn.get_array()[row, column] == np.linalg.norm(CENTERS - place, axis=1).argmin()


def test_into_given_axes_the_words_are_added(effects):
    figure, (left, right) = new_figure("Two panels.", panels=2)
    draw_effects(effects, title="one", ax=left)
    assert draw_effects(effects, title="other", ax=right) is figure
    assert re.match(r"Two panels\. one\. .* other\. ", alt_text(figure))


def test_the_nearest_centre_of_one_sample_is_named(effects):
    figure = draw_distances(effects, CENTERS, 3)
    nearest = np.linalg.norm(CENTERS - effects[3], axis=1).argmin() + 1
    assert figure.axes[0].get_title(loc="left") == f"nearest: centre {nearest}"
    assert alt_text(figure).count(" m to centre") == 3


def test_a_turn_shows_the_inertia_so_far_and_the_best(effects):
    turns = turns_from(effects, CENTERS)
    figure = draw_turn(effects, turns, 1, best=2.0)
    assert f"J = {inertia(effects, *turns[1]):.2f} m²" in figure.axes[0].get_title(loc="left")
    assert any("best known: 2.0" in text.get_text() for text in figure.axes[1].texts)
    told = re.search(r"turn by turn (.*?) m²", alt_text(figure))
    assert told[1].split(", ") == [f"{inertia(effects, *turn):.2f}" for turn in turns[:2]]
    assert png(draw_turn(effects, turns[:1]))


def test_bins_are_counted(effects):
    figure = draw_bins(effects[:, 1], 5)
    assert "5 bins, 5 of them hold samples: 5 classes" in alt_text(figure)
    shown = [int(text.get_text()) for text in figure.axes[0].texts]
    assert sum(shown) == len(effects)


@pytest.mark.parametrize("n_bins", [1, 12])
def test_few_and_many_bins_can_be_drawn(effects, n_bins):
    assert png(draw_bins(effects[:, 0], n_bins, "dy"))


def test_ends_within_six_percent_are_one_disc():
    figure = draw_inertias({"one": [5.4, 5.4, 5.5, 30.0], "other": [8.0]})
    assert "one: 3 at 5.4, 1 at 30.0; other: 1 at 8.0" in alt_text(figure)
    assert [text.get_text() for text in figure.axes[0].texts] == ["3", "1", "1"]


def test_the_farthest_sample_is_the_likeliest(effects):
    figure = draw_far_samples(effects, effects[:1], "after one")
    drawn = figure.axes[0].collections[1]
    assert drawn.get_array().argmax() == ((effects - effects[0]) ** 2).sum(axis=1).argmax()
    assert drawn.get_array().sum() == pytest.approx(100)
    assert alt_text(figure).startswith("after one. 1 centre drawn,")


def test_agreement_names_what_meets():
    figure = draw_agreement(np.array([[3, 0], [1, 2]]), ["a", "b"], ["c", "d"], ("rows", "columns"))
    assert alt_text(figure) == "Table of samples by rows and columns. a: 3 c; b: 1 c, 2 d."


def test_turns_begin_at_the_given_centres_and_never_rise(effects):
    turns = turns_from(effects, np.array(STARTS["in a heap"]))
    np.testing.assert_array_equal(turns[0][0], STARTS["in a heap"])
    inertias = [inertia(effects, *turn) for turn in turns]
    assert np.diff(inertias).max() <= 1e-9
    assert all((centers != turns[i][0]).any() for i, (centers, _) in enumerate(turns[1:]))


def test_an_empty_class_is_drawn_and_then_refilled(effects):
    turns = turns_from(effects, np.array([[0.1, 0.0], [0.8, 0.4], [-0.2, 9.0]]))
    assert np.bincount(turns[0][1], minlength=3)[2] == 0
    assert np.bincount(turns[-1][1], minlength=3).min() > 0
    assert "samples. Centres" in alt_text(draw_turn(effects, turns))


def test_where_no_kernel_runs_each_start_has_its_turns(effects):
    player = move_centers(effects).player(most=6)
    assert len(player) == 6
    assert "centres at first" in player._repr_html_()
    assert "turns of K-Means" in player._repr_html_()


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("turns", [0, TURNS - 1])
def test_the_edges_of_the_controls_can_be_drawn(effects, start, turns):
    exploration = move_centers(effects)
    assert "best known" in exploration.draw(start, turns).axes[1].texts[0].get_text()


def test_a_chosen_centre_is_moved_and_k_means_starts_there(effects):
    chosen, dy, dz, turns, start, picture = move_centers(effects).widget().children
    assert (start.value, chosen.value, dy.value, dz.value, turns.value) == ("in a heap", 1, 0.0, 0.0, 0)
    turns.value = 3
    assert "turn 3" in picture.value
    chosen.value = 6
    assert (dy.value, dz.value) == (0.36, 0.18)
    dy.value = 1.5
    dz.value = 0.9
    assert turns.value == 0
    assert "(1.50, 0.90)" in picture.value
    chosen.value = 2
    assert (dy.value, dz.value) == (0.18, 0.0)
    assert "(1.50, 0.90)" in picture.value
    turns.value = 9
    assert "(1.50, 0.90)" not in picture.value


def test_another_start_replaces_all_centres(effects):
    chosen, dy, dz, _, start, picture = move_centers(effects).widget().children
    chosen.value = 3
    dz.value = 1.0
    start.value = "in a row"
    assert (dy.value, dz.value) == (0.72, 0.6)
    assert "(0.72, 0.60)" in picture.value
    start.value = "in a heap"
    assert "(0.36, 0.00)" in picture.value
