"""Classes of one-dimensional samples: the bins of a histogram that are not empty."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, ClusterMixin
from sklearn.utils import Tags
from sklearn.utils.validation import check_is_fitted, validate_data

from stairlab._validation import whole_number
from stairlab.clustering._common import training_samples


def equal_width_edges(values: np.ndarray, n_bins: int) -> np.ndarray:
    r"""Divide the range of ``values`` into bins of equal width.

    .. math:: b_j = \min x + \frac{j}{n} (\max x - \min x), \qquad j = 0, \ldots, n

    Returns
    -------
    ndarray of shape (n_bins + 1,)
        Edges, rising, in the unit of ``values``.
    """
    return np.linspace(values.min(), values.max(), n_bins + 1)


def bin_of(values: np.ndarray, bin_edges: np.ndarray) -> np.ndarray:
    r"""Return the bin j of each value, :math:`b_j \le x < b_{j+1}`.

    The last bin includes its right edge too; what lies outside all bins goes to the first or last one.
    """
    n_bins = len(bin_edges) - 1
    return np.clip(np.searchsorted(bin_edges, values, side="right") - 1, 0, n_bins - 1)


class HistogramBins(ClusterMixin, BaseEstimator):
    """One-dimensional clustering: bins of equal width over the range of the data, without the empty ones.

    Parameters
    ----------
    n_bins : int
        Number of bins before the empty ones are dropped.

    Attributes
    ----------
    bin_edges_ : ndarray of shape (n_bins + 1,)
        Edges of all bins, in the unit of ``X``.
    edges_ : ndarray of shape (n_clusters, 2)
        Lower and upper edge of each bin that was kept, in rising order. A sample on an inner edge is in the
        upper bin.
    n_clusters_ : int
        Number of bins that were kept.
    labels_ : ndarray of shape (n_samples,), int
        Index into ``edges_`` for each sample.
    n_features_in_ : int
        Number of features, always 1.

    Examples
    --------
    >>> bins = HistogramBins(n_bins=4).fit([0.0, 0.01, 0.3, 1.2])
    >>> bins.labels_.tolist()
    [0, 0, 1, 2]
    >>> bins.edges_.round(3).tolist()
    [[0.0, 0.3], [0.3, 0.6], [0.9, 1.2]]
    """

    def __init__(self, n_bins: int = 10) -> None:
        self.n_bins = n_bins

    def __sklearn_tags__(self) -> Tags:
        """Tell scikit-learn that samples have one dimension."""
        tags = super().__sklearn_tags__()
        tags.input_tags.one_d_array = True
        tags.input_tags.two_d_array = False
        return tags

    def fit(self, X: ArrayLike, y: Any = None) -> HistogramBins:
        """Find the bins.

        Parameters
        ----------
        X : array-like of shape (n_samples,) or (n_samples, 1)
            Samples: finite, at least two, not all equal.
        y : None
            Not used; scikit-learn's conventions ask for it.

        Returns
        -------
        HistogramBins
            This estimator, fitted.

        Raises
        ------
        ValueError
            If ``X`` is not as above, or ``n_bins`` is less than 1.
        TypeError
            If ``n_bins`` is not a whole number.
        """
        whole_number("n_bins", self.n_bins, low=1)
        values = _only_column(training_samples(self, _as_column(X)))
        self.bin_edges_ = equal_width_edges(values, self.n_bins)
        self._kept, self.labels_ = np.unique(bin_of(values, self.bin_edges_), return_inverse=True)
        self.edges_ = np.stack([self.bin_edges_[self._kept], self.bin_edges_[self._kept + 1]], axis=1)
        self.n_clusters_ = len(self._kept)
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Return the bin of each sample; the nearest one that was kept where it lies in none.

        Parameters
        ----------
        X : array-like of shape (n_samples,) or (n_samples, 1)
            Samples, finite.

        Returns
        -------
        ndarray of shape (n_samples,), int
            Indices into ``edges_``.

        Raises
        ------
        ValueError
            If ``X`` is not finite, empty, or has more than one feature.
        """
        check_is_fitted(self)
        values = _only_column(validate_data(self, _as_column(X), dtype=np.float64, reset=False))
        bins = bin_of(values, self.bin_edges_)
        kept = np.isin(bins, self._kept)
        return np.where(kept, np.searchsorted(self._kept, bins), self._nearest_kept(values))

    def _nearest_kept(self, values: np.ndarray) -> np.ndarray:
        """Index of the kept bin with the smallest distance (the lower of two equally near ones)."""
        low, high = self.edges_.T[:, :, None]
        return np.maximum(low - values, values - high).argmin(axis=0)


def _as_column(X: ArrayLike) -> Any:
    """Turn shape (n_samples,) into (n_samples, 1); leave everything else for scikit-learn to check."""
    return np.reshape(np.asarray(X), (-1, 1)) if np.ndim(X) == 1 else X


def _only_column(X: np.ndarray) -> np.ndarray:
    if X.shape[1] != 1:
        raise ValueError(f"X must have one feature, shape (n_samples,) or (n_samples, 1), not {X.shape}.")
    return X[:, 0]
