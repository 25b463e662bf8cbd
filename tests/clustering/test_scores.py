import tracemalloc

import numpy as np
import pytest
import sklearn.metrics
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from stairlab.clustering import davies_bouldin_score, silhouette_samples, silhouette_score, silhouette_scores
from stairlab.clustering import scores as scores_module


def clustered(seed, n_samples=200, n_features=2, n_clusters=4, offset=0.0):
    rng = np.random.default_rng(seed)
    centers = rng.normal(scale=3, size=(n_clusters, n_features)) + offset
    labels = np.concatenate([np.arange(n_clusters), rng.integers(n_clusters, size=n_samples - n_clusters)])
    return centers[labels] + rng.normal(size=(n_samples, n_features)), labels


CASES = [
    {"n_samples": n_samples, "n_features": n_features, "n_clusters": n_clusters}
    for n_samples, n_features, n_clusters in [(20, 1, 3), (200, 2, 2), (200, 5, 10), (1000, 3, 6)]
]
ALONE = [{"n_samples": 3, "n_features": 1, "n_clusters": 2}, {"n_samples": 150, "n_features": 3, "n_clusters": 149}]


def davies_bouldin_by_loops(X, labels):
    clusters = [X[labels == name] for name in np.unique(labels)]
    widths = [np.mean([np.linalg.norm(x - cluster.mean(axis=0)) for x in cluster]) for cluster in clusters]

    def ratio(i, j):
        return (widths[i] + widths[j]) / np.linalg.norm(clusters[i].mean(axis=0) - clusters[j].mean(axis=0))

    k = len(clusters)
    return np.mean([max(ratio(i, j) for j in range(k) if j != i) for i in range(k)])


@pytest.mark.parametrize("case", CASES + ALONE)
@pytest.mark.parametrize("seed", range(5))
def test_silhouettes_equal_scikit_learns(case, seed):
    X, labels = clustered(seed, **case)
    np.testing.assert_allclose(silhouette_samples(X, labels), sklearn.metrics.silhouette_samples(X, labels), atol=1e-9)
    assert silhouette_score(X, labels) == pytest.approx(sklearn.metrics.silhouette_score(X, labels), abs=1e-9)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", range(5))
def test_davies_bouldin_equals_scikit_learns(case, seed):
    X, labels = clustered(seed, **case)
    assert davies_bouldin_score(X, labels) == pytest.approx(
        sklearn.metrics.davies_bouldin_score(X, labels), rel=1e-9, abs=1e-9
    )


@pytest.mark.parametrize("case", CASES + ALONE)
def test_davies_bouldin_equals_plain_loops_also_where_a_sample_is_alone(case):
    # scikit-learn's own distance of such a sample to its centre is not 0, but some 1e-8, which shows in its score.
    X, labels = clustered(0, **case)
    assert davies_bouldin_score(X, labels) == pytest.approx(davies_bouldin_by_loops(X, labels), rel=1e-12)


@given(
    rows=st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(0, 3)), min_size=4, max_size=40).filter(
        lambda rows: 2 <= len({label for *_, label in rows}) < len(rows)
    )
)
@settings(derandomize=True, deadline=None)
def test_silhouettes_equal_scikit_learns_with_duplicates_and_clusters_of_one(rows):
    *columns, labels = np.array(rows).T
    X = np.stack(columns, axis=1).astype(float)
    # scikit-learn's own distances between duplicates are not exactly 0, so it gets exact ones.
    expected = sklearn.metrics.silhouette_score(cdist(X, X), labels, metric="precomputed")
    assert silhouette_score(X, labels) == pytest.approx(expected, abs=1e-9)
    assert davies_bouldin_score(X, labels) >= 0


@pytest.mark.parametrize("chunk_bytes", [1, 8 * 200 * 7, 10**9])
def test_several_clusterings_at_once_score_as_each_alone_in_chunks_of_any_size(monkeypatch, chunk_bytes):
    X, _ = clustered(0)
    labelings = [np.random.default_rng(k).integers(k, size=len(X)) for k in range(2, 11)]
    monkeypatch.setattr(scores_module, "CHUNK_BYTES", chunk_bytes)
    expected = [sklearn.metrics.silhouette_score(X, labels) for labels in labelings]
    np.testing.assert_allclose(silhouette_scores(X, labelings), expected, atol=1e-9)


def test_scores_do_not_depend_on_where_the_data_lie_or_how_clusters_are_called():
    X, labels = clustered(1)
    names = np.array(["short", "long", "far", "high"])[labels]
    for score in (silhouette_score, davies_bouldin_score):
        assert score(X + 1e6, names) == pytest.approx(score(X, labels), abs=1e-8)
        assert score(X, labels - 7) == pytest.approx(score(X, labels), abs=1e-12)


def test_the_silhouette_of_two_pairs_is_the_one_computed_by_hand():
    # 0 and 1 against 4 and 5: a = 1; b = (4 + 5) / 2 for the outer samples, (3 + 4) / 2 for the inner ones.
    outer, inner = 3.5 / 4.5, 2.5 / 3.5
    np.testing.assert_allclose(
        silhouette_samples([[0], [1], [4], [5]], [0, 0, 1, 1]), [outer, inner, inner, outer], atol=1e-12
    )


def test_davies_bouldin_of_two_pairs_is_the_one_computed_by_hand():
    assert davies_bouldin_score([[0], [1], [4], [5]], [0, 0, 1, 1]) == pytest.approx((0.5 + 0.5) / 4)


def test_coinciding_clusters_score_zero():
    X, labels = np.ones((6, 2)), [0, 0, 0, 1, 1, 1]
    assert silhouette_score(X, labels) == 0
    assert davies_bouldin_score(X, labels) == 0


def test_ten_thousand_samples_take_less_than_500_megabytes():
    X, labels = clustered(0, n_samples=10_000)
    tracemalloc.start()
    silhouette_scores(X, [labels, np.arange(10_000) // 10])
    davies_bouldin_score(X, labels)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 500e6


@pytest.mark.parametrize("score", [silhouette_score, silhouette_samples, davies_bouldin_score])
@pytest.mark.parametrize(
    ("X", "labels", "message"),
    [
        ([[0.0], [1.0], [np.nan]], [0, 0, 1], "X must be finite"),
        ([[0.0], [1.0], [np.inf]], [0, 0, 1], "X must be finite"),
        ([0.0, 1.0, 2.0], [0, 0, 1], "X must have the shape"),
        (np.zeros((0, 2)), [], "X must have at least 1 row"),
        ([[0.0]], [0], "clusters"),
        ([[0.0], [1.0], [2.0]], [0, 0], "one label a sample"),
        ([[0.0], [1.0], [2.0]], [[0], [0], [1]], "one label a sample"),
        ([[0.0], [1.0], [2.0]], [0, 0, 0], "2 to n_samples - 1 = 2 clusters, not 1"),
        ([[0.0], [1.0], [2.0]], [0, 1, 2], "2 to n_samples - 1 = 2 clusters, not 3"),
    ],
)
def test_bad_input_is_refused(score, X, labels, message):
    with pytest.raises(ValueError, match=message):
        score(X, labels)


def test_a_bad_clustering_among_several_is_named():
    with pytest.raises(ValueError, match=r"labelings\[1\]"):
        silhouette_scores([[0.0], [1.0], [2.0]], [[0, 0, 1], [0, 0, 0]])
    with pytest.raises(ValueError, match="at least one"):
        silhouette_scores([[0.0], [1.0], [2.0]], [])
