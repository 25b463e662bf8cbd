import numpy as np
import pytest
import sklearn.cluster
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.utils.estimator_checks import parametrize_with_checks

from stairlab.clustering import KMeans
from stairlab.clustering.kmeans import (
    kmeans_plus_plus,
    mean_of_clusters,
    nearest_center,
    refill_empty_clusters,
)


def varied_data(seed):
    """Blobs, uniform and skewed samples, curves; 30 to 800 of them in 1 to 6 dimensions."""
    rng = np.random.default_rng(seed)
    n, dimensions, k = int(rng.integers(30, 800)), int(rng.integers(1, 7)), int(rng.integers(2, 11))
    kind = seed % 4
    if kind == 0:
        centers = rng.normal(scale=4, size=(k, dimensions))
        return centers[rng.integers(k, size=n)] + rng.normal(size=(n, dimensions)), k
    if kind == 1:
        return rng.uniform(size=(n, dimensions)), k
    if kind == 2:
        return rng.lognormal(size=(n, dimensions)), k
    t = rng.uniform(0, 6, size=n)
    return np.stack([np.sin((j + 1) * t) for j in range(dimensions)], axis=1) + 0.1 * rng.normal(
        size=(n, dimensions)
    ), k


# No exemption is needed.
@parametrize_with_checks([KMeans(), KMeans(n_clusters=3, init="random", record_history=True)])
@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
def test_it_follows_scikit_learns_conventions(estimator, check):
    check(estimator)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("tol", [1e-4, 0.0, 0.05])
def test_from_the_same_centres_it_ends_where_scikit_learn_ends(seed, tol):
    X, k = varied_data(seed)
    init = X[np.random.default_rng(seed).choice(len(X), k, replace=False)]
    ours = KMeans(k, init=init, tol=tol).fit(X)
    theirs = sklearn.cluster.KMeans(k, init=init, n_init=1, tol=tol).fit(X)
    np.testing.assert_array_equal(ours.labels_, theirs.labels_)
    np.testing.assert_allclose(ours.cluster_centers_, theirs.cluster_centers_, rtol=1e-9, atol=1e-9)
    assert ours.inertia_ == pytest.approx(theirs.inertia_, rel=1e-9)
    assert ours.n_iter_ == theirs.n_iter_


@pytest.mark.parametrize("seed", range(10))
def test_empty_clusters_are_refilled_as_scikit_learn_refills_them(seed):
    X, k = varied_data(seed)
    init = X[:k] + np.where(np.arange(k) == k - 1, 1e3, 0)[:, None]  # the last centre wins no sample
    ours = KMeans(k, init=init).fit(X)
    theirs = sklearn.cluster.KMeans(k, init=init, n_init=1).fit(X)
    np.testing.assert_array_equal(ours.labels_, theirs.labels_)
    assert ours.inertia_ == pytest.approx(theirs.inertia_, rel=1e-9)


@pytest.mark.slow
def test_from_own_starts_it_is_as_good_as_scikit_learn():
    ratios = []
    for seed in range(50):
        X, k = varied_data(seed)
        theirs = sklearn.cluster.KMeans(k, n_init=10, random_state=seed).fit(X)
        ratios.append(KMeans(k, random_state=seed).fit(X).inertia_ / theirs.inertia_)
    assert np.median(ratios) <= 1.001


POINTS = st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=2, max_size=40).filter(
    lambda points: len(set(points)) > 1
)


@given(points=POINTS, data=st.data())
@settings(derandomize=True, deadline=None)
def test_labels_fit_the_centres_and_no_cluster_is_empty(points, data):
    X = np.array(points, dtype=float)
    k = data.draw(st.integers(1, len(set(points))))
    init = data.draw(st.sampled_from(["k-means++", "random", X[:1].repeat(k, axis=0)]))
    max_iter = data.draw(st.sampled_from([1, 2, 300]))
    fitted = KMeans(k, init=init, n_init=2, max_iter=max_iter).fit(X)
    np.testing.assert_array_equal(np.unique(fitted.labels_), np.arange(k))
    np.testing.assert_array_equal(fitted.predict(X), fitted.labels_)
    distances = fitted.transform(X)
    np.testing.assert_array_equal(distances.argmin(axis=1), fitted.labels_)
    assert fitted.inertia_ == pytest.approx((distances.min(axis=1) ** 2).sum(), abs=1e-9)


@given(points=POINTS)
@settings(derandomize=True, deadline=None)
def test_as_many_clusters_as_distinct_points_leave_no_inertia(points):
    X = np.array(points, dtype=float)
    k = len(set(points))
    assert KMeans(k, n_init=1).fit(X).inertia_ == pytest.approx(0, abs=1e-18)
    with pytest.raises(ValueError, match=f"at most {k}, the number of distinct samples"):
        KMeans(k + 1).fit(X)


def test_one_cluster_has_the_mean_as_its_centre():
    X = np.random.default_rng(0).normal(size=(50, 3))
    fitted = KMeans(1).fit(X)
    np.testing.assert_allclose(fitted.cluster_centers_[0], X.mean(axis=0), atol=1e-12)
    assert fitted.inertia_ == pytest.approx(len(X) * X.var(axis=0).sum())


def test_the_history_ends_in_the_result_and_its_inertia_falls():
    X, k = varied_data(0)
    fitted = KMeans(k, record_history=True).fit(X)
    inertias = [((X - step.centers[step.labels]) ** 2).sum() for step in fitted.history_]
    assert (np.diff(inertias) <= 1e-9).all()
    np.testing.assert_array_equal(fitted.history_[-1].centers, fitted.cluster_centers_)
    np.testing.assert_array_equal(fitted.history_[-1].labels, fitted.labels_)
    assert len(fitted.history_) == fitted.n_iter_ + 1
    assert not hasattr(KMeans(k).fit(X), "history_")


def test_more_starts_are_never_worse():
    X, k = varied_data(1)
    one, ten = (KMeans(k, n_init=n, init="random").fit(X).inertia_ for n in (1, 10))
    assert ten <= one


@pytest.mark.parametrize("seed", [3, np.random.SeedSequence(3)])
def test_the_same_seed_gives_the_same_result_every_time(seed):
    X, k = varied_data(2)
    estimator = KMeans(k, n_init=1, random_state=seed)
    first, second = (estimator.fit(X).cluster_centers_ for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_other_seeds_give_other_starts():
    X, k = varied_data(1)
    first, second = (KMeans(k, n_init=1, random_state=seed).fit(X).cluster_centers_ for seed in (0, 1))
    assert not np.array_equal(first, second)


def test_k_means_plus_plus_draws_distinct_samples_far_apart():
    X = np.repeat([[0.0, 0.0], [0.0, 1.0], [5.0, 5.0]], [50, 50, 1], axis=0)
    for seed in range(20):
        centers = kmeans_plus_plus(X, 3, np.random.default_rng(seed))
        np.testing.assert_array_equal(np.unique(centers, axis=0), np.unique(X, axis=0))


def test_a_step_of_lloyds_algorithm_is_the_one_computed_by_hand():
    X = np.array([[0.0], [2.0], [10.0]])
    labels = nearest_center(X, np.array([[0.0], [9.0]]))
    np.testing.assert_array_equal(labels, [0, 0, 1])
    np.testing.assert_array_equal(mean_of_clusters(X, labels, 2), [[1.0], [10.0]])


def test_an_empty_cluster_gets_the_farthest_sample_that_is_not_alone():
    X = np.array([[0.0], [1.0], [3.0], [99.0]])
    labels = np.array([0, 0, 0, 1])
    centers = np.array([[0.0], [0.0], [50.0]])
    np.testing.assert_array_equal(refill_empty_clusters(X, labels, centers), [0, 0, 2, 1])


def test_tiny_and_far_away_numbers_do_no_harm():
    X = np.array([[0.0], [1e-200], [1.0]])
    assert KMeans(3).fit(X).cluster_centers_.shape == (3, 1)
    shifted = KMeans(2).fit(np.array([[1e9], [1e9 + 1], [1e9 + 10]]))
    np.testing.assert_allclose(np.sort(shifted.cluster_centers_, axis=0), [[1e9 + 0.5], [1e9 + 10]], rtol=1e-15)


GOOD = [[0.0, 0.0], [1.0, 0.0], [2.0, 5.0]]


@pytest.mark.parametrize(
    ("X", "message"),
    [
        ([], "2D array"),
        (np.zeros((0, 2)), "0 sample"),
        ([[1.0, 2.0]], "minimum of 2"),
        ([1.0, 2.0, 3.0], "2D array"),
        ([[1.0, 2.0], [1.0, 2.0]], "distinct"),
        ([[0.0], [np.nan]], "NaN"),
        ([[0.0], [np.inf]], "infinity"),
        ([[0.0], [1e200]], "1e\\+100"),
        ([[0.0], [1e-200]], "1e-100"),
    ],
)
def test_bad_samples_are_refused(X, message):
    with pytest.raises(ValueError, match=message):
        KMeans(1).fit(X)


@pytest.mark.parametrize(
    ("arguments", "error", "name"),
    [
        ({"n_clusters": 0}, ValueError, "n_clusters"),
        ({"n_clusters": 4}, ValueError, "n_clusters"),
        ({"n_clusters": 1.5}, TypeError, "n_clusters"),
        ({"n_init": 0}, ValueError, "n_init"),
        ({"n_init": "auto"}, TypeError, "n_init"),
        ({"max_iter": 0}, ValueError, "max_iter"),
        ({"tol": -1.0}, ValueError, "tol"),
        ({"tol": np.nan}, ValueError, "tol"),
        ({"init": "kmeans"}, ValueError, "init"),
        ({"init": [[0.0, 0.0]]}, ValueError, "init"),
        ({"init": [[0.0, 0.0], [np.nan, 0.0]]}, ValueError, "init"),
        ({"random_state": -1}, ValueError, "random_state"),
        ({"random_state": "seed"}, TypeError, "random_state"),
    ],
)
def test_bad_arguments_are_refused_by_name(arguments, error, name):
    with pytest.raises(error, match=name):
        KMeans(**{"n_clusters": 2, **arguments}).fit(GOOD)


def test_new_samples_must_have_the_features_of_the_training_samples():
    fitted = KMeans(2).fit(GOOD)
    for method in (fitted.predict, fitted.transform):
        with pytest.raises(ValueError, match="3 features"):
            method([[0.0, 0.0, 0.0]])
        with pytest.raises(ValueError, match="NaN"):
            method([[0.0, np.nan]])
