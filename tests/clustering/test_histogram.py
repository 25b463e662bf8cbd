import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.exceptions import NotFittedError

from stairlab.clustering import HistogramBins

VALUES = st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=60).filter(lambda x: max(x) - min(x) > 1e-6)


@given(values=VALUES, n_bins=st.integers(1, 20))
@settings(derandomize=True, deadline=None)
def test_the_kept_bins_and_their_sizes_are_those_of_numpys_histogram(values, n_bins):
    counts, edges = np.histogram(values, bins=n_bins)
    fitted = HistogramBins(n_bins).fit(values)
    np.testing.assert_allclose(fitted.bin_edges_, edges, rtol=0, atol=1e-9)
    assert fitted.n_clusters_ == len(fitted.edges_) <= n_bins
    np.testing.assert_array_equal(np.bincount(fitted.labels_), counts[counts > 0])


@given(values=VALUES, n_bins=st.integers(1, 20))
@settings(derandomize=True, deadline=None)
def test_every_sample_lies_within_the_edges_of_its_bin(values, n_bins):
    fitted = HistogramBins(n_bins).fit(values)
    low, high = fitted.edges_[fitted.labels_].T
    assert (low <= values).all()
    assert (np.array(values) <= high).all()


@given(values=VALUES, n_bins=st.integers(1, 20))
@settings(derandomize=True, deadline=None)
def test_predict_repeats_the_labels_of_the_training_samples(values, n_bins):
    fitted = HistogramBins(n_bins).fit(values)
    np.testing.assert_array_equal(fitted.predict(values), fitted.labels_)


def test_the_right_edge_belongs_to_the_last_bin_and_inner_edges_to_the_upper_one():
    fitted = HistogramBins(4).fit([0.0, 1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(fitted.labels_, [0, 1, 2, 3, 3])


def test_empty_bins_are_dropped():
    fitted = HistogramBins(10).fit([0.0, 0.1, 9.5, 10.0])
    assert fitted.n_clusters_ == 2
    np.testing.assert_allclose(fitted.edges_, [[0, 1], [9, 10]])
    np.testing.assert_array_equal(fitted.labels_, [0, 0, 1, 1])


def test_samples_outside_all_kept_bins_go_to_the_nearest_one():
    fitted = HistogramBins(10).fit([0.0, 10.0])
    np.testing.assert_array_equal(fitted.predict([-5.0, 1.0, 4.9, 5.0, 5.1, 9.0, 99.0]), [0, 0, 0, 0, 1, 1, 1])


def test_a_column_and_a_flat_array_are_the_same_samples():
    values = np.random.default_rng(0).normal(size=30)
    flat, column = HistogramBins().fit(values), HistogramBins().fit(values[:, None])
    np.testing.assert_array_equal(flat.labels_, column.labels_)
    np.testing.assert_array_equal(flat.predict(values), column.predict(values[:, None]))


def test_it_follows_scikit_learns_conventions():
    # check_estimator skips estimators that do not take several features, so its main points are checked here.
    bins = HistogramBins(n_bins=3)
    assert clone(bins).get_params() == {"n_bins": 3}
    assert bins.set_params(n_bins=4) is bins
    assert bins.fit([0, 1, 2, 3]) is bins
    assert bins.n_features_in_ == 1
    np.testing.assert_array_equal(bins.fit_predict([0, 1, 2, 3]), bins.labels_)
    with pytest.raises(NotFittedError):
        HistogramBins().predict([1.0])


@pytest.mark.parametrize(
    ("X", "message"),
    [
        ([], "0 sample"),
        ([1.0], "minimum of 2"),
        ([2.0, 2.0, 2.0], "distinct"),
        ([0.0, np.nan], "NaN"),
        ([0.0, np.inf], "infinity"),
        ([[0.0, 1.0], [1.0, 0.0]], "one feature"),
        (np.zeros((2, 1, 1)), "dim 3"),
        ([0.0, 1e300], "1e\\+100"),
    ],
)
def test_bad_samples_are_refused(X, message):
    with pytest.raises(ValueError, match=message):
        HistogramBins().fit(X)


@pytest.mark.parametrize(("n_bins", "error"), [(0, ValueError), (-1, ValueError), (2.5, TypeError), ("a", TypeError)])
def test_a_bad_number_of_bins_is_refused(n_bins, error):
    with pytest.raises(error, match="n_bins"):
        HistogramBins(n_bins).fit([0.0, 1.0])


@pytest.mark.parametrize("X", [[np.nan], [], [[1.0, 2.0]]])
def test_bad_new_samples_are_refused(X):
    with pytest.raises(ValueError, match=r"NaN|0 sample|features"):
        HistogramBins().fit([0.0, 1.0]).predict(X)
