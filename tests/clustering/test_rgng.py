import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist
from sklearn.utils.estimator_checks import parametrize_with_checks

from stairlab.clustering import KMeans, RobustGrowingNeuralGas
from stairlab.clustering.rgng import (
    NO_EDGE,
    Network,
    attract,
    description_length,
    first_network,
    harmonic_mean_distances,
    insert_node,
    learning_rate,
    nearest_two,
    node_errors,
    prune,
    refresh_edges,
    repel,
    restrict,
    train_pass,
)

PUBLISHED = ((0.1, 0.01), (0.005, 0.0005), (2.0, 0.1), 100)


def mean_distance(X, nodes):
    return cdist(X, nodes).min(axis=1).mean()


def blobs(seed, spread=0.6):
    """Three to six blobs of 100, 300 or 1,000 samples in all."""
    rng = np.random.default_rng(seed)
    k, n = 3 + seed % 4, [100, 300, 1000][seed % 3]
    centers = rng.uniform(-5, 5, size=(k, 2))
    return centers[rng.integers(k, size=n)] + spread * rng.normal(size=(n, 2))


def with_outliers(X, seed, share=0.05, deviations=10):
    """Replace a share of the samples by outliers in random directions; return all samples and the clean ones."""
    rng = np.random.default_rng(seed)
    replaced = rng.choice(len(X), int(share * len(X)), replace=False)
    angle = rng.uniform(0, 2 * np.pi, size=len(replaced))
    dirty = X.copy()
    dirty[replaced] = X.mean(axis=0) + deviations * X.std(axis=0) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return dirty, np.delete(X, replaced, axis=0)


def network_of(nodes, edges, ages=0, room=None):
    nodes = np.array(nodes, dtype=float)
    n, room = len(nodes), room or len(nodes)
    network = Network(np.zeros((room, nodes.shape[1])), np.full((room, room), NO_EDGE), np.ones(room))
    network.nodes[:n] = nodes
    for (i, j), age in zip(edges, np.broadcast_to(ages, len(edges)), strict=True):
        network.ages[i, j] = network.ages[j, i] = age
    return network


# What the whole network does.


# No exemption is needed.
@parametrize_with_checks([RobustGrowingNeuralGas(), RobustGrowingNeuralGas(max_nodes=3, record_history=True)])
@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
def test_it_follows_scikit_learns_conventions(estimator, check):
    check(estimator)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize(("distance", "n_each"), [(8, 20), (100, 50), (1e4, 200)])
def test_two_well_separated_blobs_and_two_nodes_give_one_node_each(seed, distance, n_each):
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(2 * n_each, 2)) + np.repeat([[0, 0], [distance, 0]], n_each, axis=0)
    fitted = RobustGrowingNeuralGas(2, random_state=seed).fit(X)
    np.testing.assert_array_equal(np.sort(fitted.nodes_[:, 0] > distance / 2), [False, True])
    assert mean_distance(X, fitted.nodes_) < 2


@pytest.mark.parametrize("seed", range(20))
def test_on_clean_data_samples_are_as_near_to_nodes_as_to_as_many_k_means_centres(seed):
    X = blobs(seed)
    nodes = RobustGrowingNeuralGas(random_state=seed).fit(X).nodes_
    centers = KMeans(len(nodes)).fit(X).cluster_centers_
    assert mean_distance(X, nodes) <= 1.05 * mean_distance(X, centers)


def test_outliers_move_nodes_less_than_k_means_centres():
    growth, growth_of_k_means = [], []
    for seed in range(20):
        X = blobs(seed)
        dirty, clean = with_outliers(X, seed)
        before, after = (RobustGrowingNeuralGas(random_state=seed).fit(data).nodes_ for data in (X, dirty))
        growth.append(mean_distance(clean, after) / mean_distance(clean, before))
        before, after = (KMeans(len(nodes)).fit(data).cluster_centers_ for nodes, data in [(before, X), (after, dirty)])
        growth_of_k_means.append(mean_distance(clean, after) / mean_distance(clean, before))
    print(f"growth by outliers: RGNG {np.median(growth):.3f}, K-Means {np.median(growth_of_k_means):.3f}")
    assert np.median(growth) < np.median(growth_of_k_means)
    assert np.median(growth) < 1.05


@pytest.mark.parametrize("k", [3, 4, 5])
def test_the_description_length_finds_the_number_of_well_separated_blobs(k):
    rng = np.random.default_rng(k)
    angle = 2 * np.pi * np.arange(k) / k
    centers = 10 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    X = np.repeat(centers, 80, axis=0) + 0.5 * rng.normal(size=(80 * k, 2))
    fitted = RobustGrowingNeuralGas(10).fit(X)
    assert len(fitted.nodes_) == k
    assert min(fitted.mdl_, key=fitted.mdl_.get) == k
    assert set(fitted.mdl_) == set(range(2, 11))


@given(
    points=st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=2, max_size=30).filter(
        lambda points: len(set(points)) > 1
    ),
    max_nodes=st.integers(2, 8),
    seed=st.integers(0, 1000),
)
@settings(derandomize=True, deadline=None)
def test_whatever_the_data_there_are_at_most_max_nodes_and_all_parts_agree(points, max_nodes, seed):
    X = np.array(points, dtype=float)
    fitted = RobustGrowingNeuralGas(max_nodes, random_state=seed).fit(X)
    n = len(fitted.nodes_)
    assert 2 <= n <= min(max_nodes, len(set(points)))
    assert n == min(fitted.mdl_, key=fitted.mdl_.get)
    assert max(fitted.mdl_) <= max_nodes
    assert np.isfinite(fitted.nodes_).all()
    assert fitted.errors_.shape == (n,)
    assert set(fitted.edges_.ravel()) == set(range(n))
    assert (fitted.edges_[:, 0] < fitted.edges_[:, 1]).all()
    np.testing.assert_array_equal(fitted.predict(X), fitted.labels_)
    np.testing.assert_array_equal(cdist(X, fitted.nodes_).argmin(axis=1), fitted.labels_)


@pytest.mark.parametrize("random_state", [5, np.random.SeedSequence(5)])
def test_the_same_seed_gives_the_same_nodes(random_state):
    X = blobs(0)
    estimator = RobustGrowingNeuralGas(6, random_state=random_state)
    first, second = (estimator.fit(X).nodes_ for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_other_seeds_give_other_nodes():
    first, second = (RobustGrowingNeuralGas(3, random_state=seed).fit(blobs(0)).nodes_ for seed in (0, 1))
    assert not np.array_equal(first, second)


@pytest.mark.parametrize(("scale", "shift"), [(1e-6, 0.0), (1e6, 0.0), (4.0, 1024.0)])
def test_the_unit_and_origin_of_the_data_do_not_matter(scale, shift):
    X = blobs(1)
    plain = RobustGrowingNeuralGas(6).fit(X)
    other = RobustGrowingNeuralGas(6).fit(X * scale + shift)
    np.testing.assert_allclose((other.nodes_ - shift) / scale, plain.nodes_, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(other.errors_ / scale, plain.errors_, rtol=1e-3)
    np.testing.assert_array_equal(other.labels_, plain.labels_)


def test_the_history_holds_every_insertion_and_pass_and_does_not_change_the_result():
    X = blobs(2)
    fitted = RobustGrowingNeuralGas(5, record_history=True).fit(X)
    events = [step.event for step in fitted.history_]
    assert events[0] == "start"
    assert events.count("pass") == fitted.n_passes_
    assert events.count("insertion") == 3
    assert [len(step.nodes) for step in fitted.history_ if step.event == "insertion"] == [3, 4, 5]
    for step in fitted.history_:
        assert step.errors.shape == (len(step.nodes),)
        assert step.edges.max() < len(step.nodes)
    last_of_each_size = {len(step.nodes): step for step in fitted.history_}
    np.testing.assert_array_equal(last_of_each_size[len(fitted.nodes_)].nodes, fitted.nodes_)
    plain = RobustGrowingNeuralGas(5).fit(X)
    np.testing.assert_array_equal(plain.nodes_, fitted.nodes_)
    assert not hasattr(plain, "history_")


def test_a_tolerance_that_every_pass_meets_ends_each_size_after_one_pass():
    assert RobustGrowingNeuralGas(4, tol=1e9).fit(blobs(0)).n_passes_ == 3


def test_it_ends_although_edges_and_nodes_are_pruned_all_the_time():
    X = np.random.default_rng(0).uniform(size=(200, 2))
    fitted = RobustGrowingNeuralGas(10, max_edge_age=1, n_passes=3, record_history=True).fit(X)
    assert 2 <= len(fitted.nodes_) <= 10
    sizes = [len(step.nodes) for step in fitted.history_]
    assert min(np.diff(sizes)) < 0  # some node was removed


@pytest.mark.parametrize("n_features", [1, 3, 8])
def test_it_takes_any_number_of_features(n_features):
    X = np.random.default_rng(0).normal(size=(60, n_features))
    assert RobustGrowingNeuralGas(4).fit(X).nodes_.shape[1] == n_features


SCRIPT = """
import sys, numpy as np
from stairlab.clustering import RobustGrowingNeuralGas
X = np.random.default_rng(0).normal(size=(40, 2))
np.save(sys.argv[1], RobustGrowingNeuralGas(4, n_passes=3).fit(X).nodes_)
"""


def test_compiled_functions_take_only_plain_types():
    # Numba's cache names the classes of arguments with their module; it would break where that is imported otherwise.
    RobustGrowingNeuralGas(2, n_passes=1).fit(blobs(0))
    assert "Network" not in str(train_pass.signatures)
    assert "Settings" not in str(train_pass.signatures)


@pytest.mark.slow
def test_with_the_compiler_off_the_nodes_are_the_same(tmp_path):
    for jit in "01":
        environment = {**os.environ, "NUMBA_DISABLE_JIT": jit}
        subprocess.run([sys.executable, "-c", SCRIPT, str(tmp_path / jit)], env=environment, check=True)
    stepped, compiled = (np.load(tmp_path / f"{jit}.npy") for jit in "10")
    np.testing.assert_allclose(stepped, compiled, rtol=1e-9)


# The parts, by their letters.


def test_a_growth_begins_with_two_joined_nodes_on_distinct_samples():
    X = np.array([[0.0, 0.0]] * 9 + [[1.0, 2.0]])
    for seed in range(10):
        network = first_network(X, 5, np.random.default_rng(seed))
        np.testing.assert_array_equal(np.sort(network.nodes[:2, 1]), [0, 2])
        assert network.ages[0, 1] == network.ages[1, 0] == 0


def test_b_learning_rates_fall_with_age_from_the_initial_one():
    rates = [learning_rate((0.1, 0.01), node, 10, 10) for node in range(10)]
    assert rates[9] == pytest.approx(0.1)  # the newest, rank 1
    assert rates[0] == pytest.approx(0.1 * 0.1**0.9)  # the oldest, rank 10
    assert (np.diff(rates) > 0).all()


def test_c_the_harmonic_mean_distance_hardly_sees_far_samples_and_leaves_out_coinciding_ones():
    X = np.array([[0.0], [1.0], [2.0], [1e9]])
    np.testing.assert_allclose(harmonic_mean_distances(X, np.zeros((1, 1))), 3 / (1 + 1 / 2 + 1e-9))


def test_c_a_near_sample_pulls_by_its_distance_and_halves_the_gap_to_the_restricting_distance():
    assert restrict(1.0, 3.0) == (1.0, 2.0)
    assert restrict(3.0, 3.0) == (3.0, 3.0)


@given(gap=st.floats(1e-6, 1e9), restricting=st.floats(1e-6, 1e3))
@settings(derandomize=True, deadline=None)
def test_c_a_far_sample_pulls_by_the_harmonic_mean_and_never_twice_the_restricting_distance(gap, restricting):
    pull, following = restrict(gap, restricting)
    assert pull <= gap * (1 + 1e-12)
    assert pull <= 2 * restricting
    assert following <= 2 * restricting
    if gap > restricting:
        assert pull == following == pytest.approx(2 / (1 / gap + 1 / restricting))


def test_c_the_winner_moves_by_rate_times_pull():
    node = np.zeros(2)
    following = attract(node, 1.0, np.array([3.0, 4.0]), 0.1)
    pull = 2 / (1 / 1 + 1 / 5)
    np.testing.assert_allclose(node, 0.1 * pull * np.array([0.6, 0.8]))
    assert following == pytest.approx(pull)


def test_c_a_sample_on_the_node_changes_nothing():
    node = np.ones(2)
    assert attract(node, 3.0, np.ones(2), 0.1) == 3.0
    np.testing.assert_array_equal(node, [1.0, 1.0])


def test_d_the_push_points_away_from_the_winner_and_decays_with_the_distance():
    def pushed(gap):
        node = np.array([gap])
        repel(node, np.array([0.0]), 0.5, 0.1)
        return node[0] - gap

    assert pushed(0.1) == pytest.approx(0.5 * np.exp(-1))
    assert pushed(-0.1) == pytest.approx(-0.5 * np.exp(-1))
    assert pushed(0.01) > pushed(0.1) > pushed(1.0) > 0
    assert pushed(0.0) == 0


def test_d_neighbours_of_the_winner_move_and_other_nodes_do_not():
    network = network_of([[0.0], [2.0], [9.0]], [(0, 1), (1, 2)])
    train_pass(np.array([[0.5]]), np.array([0]), *network, 3, *PUBLISHED)
    assert network.nodes[0, 0] > 0
    assert network.nodes[1, 0] < 2
    assert network.nodes[2, 0] == 9


def test_e_winner_and_runner_up_are_the_two_nearest_nodes():
    nodes = np.random.default_rng(0).normal(size=(7, 3))
    for x in np.random.default_rng(1).normal(size=(20, 3)):
        assert nearest_two(x, nodes, 7) == tuple(cdist([x], nodes)[0].argsort()[:2])


def test_e_the_winners_edges_age_and_its_edge_to_the_runner_up_is_new():
    network = network_of([[0.0], [1.0], [2.0], [3.0]], [(0, 1), (0, 2), (2, 3)], ages=5)
    refresh_edges(network.ages, 0, 1, 4)
    assert network.ages[0, 1] == network.ages[1, 0] == 0
    assert network.ages[0, 2] == network.ages[2, 0] == 6
    assert network.ages[2, 3] == network.ages[3, 2] == 5


def test_e_old_edges_go_and_nodes_without_edges_with_them():
    network = network_of([[0.0], [1.0], [2.0], [3.0]], [(0, 2), (1, 2), (2, 3)], ages=[101, 100, 101])
    assert prune(*network, 2, 4, 100) == 2
    np.testing.assert_array_equal(network.nodes[:2, 0], [1.0, 2.0])
    np.testing.assert_array_equal(network.ages[:2, :2], [[NO_EDGE, 100], [100, NO_EDGE]])
    assert (network.ages[2:] == NO_EDGE).all()


def test_f_an_outlier_counts_no_more_than_a_sample_at_the_harmonic_mean_distance():
    X = np.array([[-1.0], [1.0], [1000.0]])
    harmonic = 3 / (1 + 1 + 1 / 1000)
    np.testing.assert_allclose(node_errors(X, np.zeros((1, 1))), 1 + 1 + harmonic)


def test_f_a_node_without_samples_has_no_error():
    assert node_errors(np.array([[0.0], [1.0]]), np.array([[0.5], [9.0]]))[1] == 0


def test_f_the_new_node_goes_halfway_between_the_worst_node_and_its_worst_neighbour():
    X = np.concatenate([np.linspace(0, 1, 20), np.linspace(10, 20, 50), np.linspace(29, 31, 20)])[:, None]
    network = network_of([[0.5], [15.0], [30.0]], [(0, 1), (1, 2)], room=4)
    errors = node_errors(X, network.nodes[:3])
    assert errors.argmax() == 1
    assert errors[2] > errors[0]
    assert insert_node(X, network, 3) == 4
    assert network.nodes[3, 0] == 22.5
    assert network.ages[1, 2] == NO_EDGE
    assert network.ages[1, 3] == network.ages[3, 2] == network.ages[0, 1] == 0


def test_g_the_description_length_is_the_one_computed_by_hand():
    X, nodes = np.array([[0.0], [1.0], [7.0], [8.0]]), np.array([[0.25], [7.5]])
    # 5 bits a point (8 / 0.25); 1 bit names the node; errors of 0, 0.75, 0.5, 0.5 take 1, log2 3, 1, 1 bits.
    expected = 2 * 5 + 4 * 1 + 1.2 * (1 + np.log2(3) + 1 + 1)
    assert description_length(X, nodes, 0.25, 1.2) == pytest.approx(expected)


def test_g_outliers_are_coded_apart():
    nodes = np.array([[0.0, 0.0], [1.0, 1.0]])
    X = np.repeat(nodes, 10, axis=0) + 0.01
    outlier = [[100.0, 100.0]]
    bits_of_point = 2 * np.log2(100.0 - 0.01)
    inliers = description_length(np.concatenate([X, outlier]), nodes, 1.0, 1.0) - 3 * bits_of_point
    assert inliers == pytest.approx(20 * (1 + 2))


# Bad input.


@pytest.mark.parametrize(
    ("X", "message"),
    [
        ([], "2D array"),
        (np.zeros((0, 2)), "0 sample"),
        ([[1.0, 2.0]], "minimum of 2"),
        ([1.0, 2.0, 3.0], "2D array"),
        ([[1.0, 2.0]] * 5, "distinct"),
        ([[0.0], [np.nan]], "NaN"),
        ([[0.0], [-np.inf]], "infinity"),
    ],
)
def test_bad_samples_are_refused(X, message):
    with pytest.raises(ValueError, match=message):
        RobustGrowingNeuralGas().fit(X)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ({"max_nodes": 1}, ValueError),
        ({"max_nodes": 3.0}, TypeError),
        ({"n_passes": 0}, ValueError),
        ({"max_edge_age": 0}, ValueError),
        ({"winner_rate_initial": 0}, ValueError),
        ({"winner_rate_final": 1.5}, ValueError),
        ({"neighbour_rate_initial": np.nan}, ValueError),
        ({"neighbour_rate_final": "slow"}, TypeError),
        ({"repulsion": -1}, ValueError),
        ({"repulsion_decay": 0}, ValueError),
        ({"accuracy": 0}, ValueError),
        ({"error_balance": -1}, ValueError),
        ({"tol": -1}, ValueError),
        ({"random_state": 1.5}, TypeError),
    ],
)
def test_bad_arguments_are_refused_by_name(arguments, error):
    with pytest.raises(error, match=next(iter(arguments))):
        RobustGrowingNeuralGas(**arguments).fit(blobs(0))


def test_a_repulsion_that_throws_nodes_out_of_the_data_is_refused():
    with pytest.raises(ValueError, match="repulsion"):
        RobustGrowingNeuralGas(5, repulsion=1e6, repulsion_decay=1e200).fit(blobs(0))


def test_new_samples_must_have_the_features_of_the_training_samples():
    fitted = RobustGrowingNeuralGas(2).fit(blobs(0))
    with pytest.raises(ValueError, match="3 features"):
        fitted.predict([[0.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="NaN"):
        fitted.predict([[0.0, np.nan]])
