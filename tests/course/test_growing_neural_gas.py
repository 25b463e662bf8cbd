"""The pictures of lesson 06."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from stairlab.clustering import RobustGrowingNeuralGas
from stairlab.course.growing_neural_gas import (
    TELLING,
    draw_ages,
    draw_choices,
    draw_growth,
    draw_network,
    draw_paths,
    draw_regions,
    draw_rivals,
    draw_tug_of_war,
    four_blobs,
    mean_distance,
    rivals,
    some_outliers,
    telling_steps,
)
from stairlab.drawing import alt_text

NODES = np.array([[1.0, 1.5], [-1.0, 0.0], [1.0, -1.5]])
CHAIN = np.array([[0, 1], [1, 2]])


@pytest.fixture(scope="module")
def band():
    """Return 60 samples on a C."""
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.5, 2 * np.pi - 0.5, size=60)
    return np.column_stack([np.cos(angle), np.sin(angle)]) * 1.5 + 0.1 * rng.normal(size=(60, 2))


@pytest.fixture(scope="module")
def history(band):
    return RobustGrowingNeuralGas(4, random_state=0, record_history=True).fit(band).history_


def texts(figure):
    return [text.get_text() for ax in figure.axes for text in ax.texts]


def test_the_mean_distance_is_that_to_the_nearest_node():
    assert mean_distance(np.array([[0.0, 0.0], [3.0, 4.0]]), np.array([[0.0, 1.0], [9.0, 9.0]])) == pytest.approx(
        (1 + np.hypot(3, 3)) / 2
    )


def test_outliers_are_all_at_their_distance_and_in_the_same_directions_at_every_distance():
    near, far = some_outliers(5, 2.0, seed=3), some_outliers(5, 20.0, seed=3)
    np.testing.assert_allclose(np.linalg.norm(near, axis=1), 2)
    np.testing.assert_allclose(far, 10 * near)
    assert some_outliers(0, 5.0).shape == (0, 2)


def test_the_four_blobs_are_four_and_have_the_networks_unit():
    X = four_blobs()
    assert len(RobustGrowingNeuralGas(6, random_state=0).fit(X).nodes_) == 4
    np.testing.assert_allclose(X.mean(axis=0), 0, atol=1e-12)
    assert X.var(axis=0).mean() == pytest.approx(1)


def test_a_network_has_its_nodes_with_their_numbers_and_its_edges(band):
    figure = draw_network(band, NODES, CHAIN, title="a chain")
    assert texts(figure) == ["0", "1", "2"]
    drawn = [line.get_xydata() for line in figure.axes[0].lines if len(line.get_xydata()) == 2]
    np.testing.assert_array_equal(drawn, NODES[CHAIN])
    assert "a chain: 3 nodes at (1.0, 1.5)" in alt_text(figure)
    assert "edges 0-1, 1-2" in alt_text(figure)


def test_a_network_without_edges_and_with_outliers_says_so(band):
    figure = draw_network(band, NODES[:1], outliers=some_outliers(3, 6.0))
    assert alt_text(figure) == "A network: 1 node at (1.0, 1.5) among 60 samples and 3 outliers."
    assert [len(drawn.get_offsets()) for drawn in figure.axes[0].collections] == [60, 3]


@pytest.mark.parametrize("edges", [CHAIN, ()])
def test_errors_are_written_beside_their_nodes(band, edges):
    figure = draw_network(band, NODES, edges, errors=np.array([1.0, 2.25, 3.0]))
    assert {"error 1.0", "error 2.2", "error 3.0"} <= set(texts(figure))


def test_a_network_can_be_drawn_into_given_axes(band):
    figure = draw_network(band, NODES)
    assert draw_network(band, NODES, ax=figure.axes[0]) is figure


@pytest.mark.parametrize("n_nodes", [2, 3])
def test_regions_count_the_samples_that_each_node_wins(band, n_nodes):
    figure = draw_regions(band, NODES[:n_nodes])
    for i, count in enumerate(np.bincount(cdist(band, NODES[:n_nodes]).argmin(axis=1), minlength=n_nodes)):
        assert f"node {i} wins {count}" in alt_text(figure)


def test_paths_begin_and_end_where_the_text_says(band):
    figure = draw_paths(band, {"slow": np.array([[2.0, 1.0], [1.0, 0.5]]), "quick": np.array([[2.0, 1.0], [0.0, 0.1]])})
    assert "slow: from (2.0, 1.0) to (1.0, 0.5)" in alt_text(figure)
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["slow", "quick"]


def test_edges_show_their_ages_and_old_ones_are_faint(band):
    ages = np.array([[-1, 7, 99], [7, -1, -1], [99, -1, -1]])
    figure = draw_ages(band, NODES, ages, title="now")
    assert {"7", "99"} <= set(texts(figure))
    young, old = (line for line in figure.axes[0].lines if len(line.get_xydata()) == 2)
    assert young.get_alpha() > old.get_alpha()
    assert "ages 0-1: 7, 0-2: 99" in alt_text(figure)
    assert "ages none" in alt_text(draw_ages(band, NODES, np.full((3, 3), -1)))


def test_the_telling_steps_are_the_start_the_insertions_and_some_passes(history):
    steps = [history[place] for place in telling_steps(history)]
    assert [step.event for step in steps].count("insertion") == 2
    assert steps[0].event == "start"
    assert len(steps) == 1 + 2 + 3 * len(TELLING)
    assert telling_steps(history)[-1] == len(history) - 1


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (0, "2 nodes, the start"),
        (1, "2 nodes, after pass 1:"),
        (20, "2 nodes, after pass 20:"),
        (21, "3 nodes, node 2 is new"),
        (22, "3 nodes, after pass 1:"),
        (62, "4 nodes, after pass 20:"),
        (999, "4 nodes, after pass 20:"),
    ],
)
def test_a_moment_of_the_growth_says_what_it_is(band, history, step, words):
    figure = draw_growth(band, history, step)
    assert alt_text(figure).startswith(words)
    left, right = figure.axes
    assert [text.get_text() for text in left.texts] == [str(i) for i in range(len(history[min(step, 62)].nodes))]
    assert [text.get_text() for text in right.texts] == ["2", "3", "4"]


def test_the_growth_of_a_network_among_outliers_shows_them_and_measures_the_others(band):
    outliers = some_outliers(3, 8.0)
    fitted = RobustGrowingNeuralGas(3, record_history=True).fit(np.vstack([band, outliers]))
    figure = draw_growth(band, fitted.history_, 5, outliers)
    assert "3 outliers" in alt_text(figure)
    assert f"are {mean_distance(band, fitted.history_[5].nodes):.2f} standard deviations" in alt_text(figure)


def test_costs_and_savings_are_counted_from_the_smallest_network_and_the_best_is_ringed():
    parts = {
        2: {"nodes": 80.0, "names": 100.0, "errors": 900.0, "outliers": 0.0},
        3: {"nodes": 120.0, "names": 150.0, "errors": 700.0, "outliers": 0.0},
        4: {"nodes": 160.0, "names": 200.0, "errors": 690.0, "outliers": 0.0},
    }
    figure = draw_tug_of_war(parts)
    assert "Sum: 2: +0, 3: -110, 4: -30. The smallest, at 3 nodes" in alt_text(figure)
    assert "outliers, by themselves" not in [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    parts[4]["outliers"] = 40.0
    figure = draw_tug_of_war(parts)
    assert "outliers, by themselves" in [text.get_text() for text in figure.axes[0].get_legend().get_texts()]


def test_one_size_alone_can_be_drawn():
    assert "2 nodes" in alt_text(draw_tug_of_war({2: {"nodes": 80.0, "names": 1.0, "errors": 2.0, "outliers": 0.0}}))


def test_choices_count_how_often_each_size_is_kept():
    seeds = [{2: 50.0, 3: 10.0, 4: 20.0}, {2: 60.0, 3: 30.0, 4: 25.0}, {2: 70.0, 3: 9.0, 4: 15.0}]
    figure = draw_choices({"some data": seeds, "other data": seeds[:1]})
    assert "some data: kept are 3 nodes 2 times, 4 nodes 1 times; lengths differ by up to 61 bits" in alt_text(figure)
    assert [text.get_text() for text in figure.axes[0].texts] == ["2", "1"]
    assert [text.get_text() for text in figure.axes[1].texts] == ["1"]


@pytest.mark.parametrize(("count", "distance"), [(3, 2), (6, 10.0), (48, 20)])
def test_rivals_are_drawn_with_what_they_are_worth(band, count, distance):
    figure = draw_rivals(band, count, distance)
    found = rivals(np.vstack([band, some_outliers(count, distance)]), 4)
    assert len(found["K-Means"]) == len(found["RGNG"])
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert titles == [f"{name}: mean distance {mean_distance(band, nodes):.2f} sd" for name, nodes in found.items()]
    assert f"60 samples and {count} outliers at {distance:g}" in alt_text(figure)


def test_by_default_outliers_hurt_k_means_more(band):
    found = rivals(np.vstack([band, some_outliers(6, 10.0)]), 4)
    assert mean_distance(band, found["RGNG"]) < mean_distance(band, found["K-Means"])
    assert "6 outliers at 10" in alt_text(draw_rivals(band))
