"""K-Means from scratch: k-means++ starts (Arthur and Vassilvitskii 2007) and Lloyd's algorithm (Lloyd 1982).

The functions are the steps of the algorithm in the order in which they run; :class:`KMeans` puts them
together and follows scikit-learn's conventions, so that it can stand in for ``sklearn.cluster.KMeans``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist
from sklearn.base import BaseEstimator, ClassNamePrefixFeaturesOutMixin, ClusterMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from stairlab._validation import Seed, finite_array, finite_number, one_of, whole_number
from stairlab.clustering._common import count_distinct, random_generator, training_samples


class KMeansStep(NamedTuple):
    """One iteration of Lloyd's algorithm: the centres, and each sample's nearest one."""

    centers: np.ndarray
    """Centres, shape (n_clusters, n_features)."""
    labels: np.ndarray
    """Index of the nearest of these centres for each sample, shape (n_samples,)."""


@dataclass(frozen=True)
class LloydRun:
    """What one start ends in."""

    centers: np.ndarray
    labels: np.ndarray
    inertia: float
    n_iter: int
    history: list[KMeansStep]


def random_centers(X: np.ndarray, n_clusters: int, rng: np.random.Generator) -> np.ndarray:
    """Draw ``n_clusters`` distinct points of ``X``, all equally likely, as first centres."""
    return rng.permutation(np.unique(X, axis=0))[:n_clusters]


def kmeans_plus_plus(X: np.ndarray, n_clusters: int, rng: np.random.Generator) -> np.ndarray:
    r"""Draw first centres far from each other (k-means++).

    The first centre is any sample. Every other one is sample i with probability

    .. math:: p_i = D_i^2 / \sum_j D_j^2, \qquad D_i = \min_c \lVert x_i - c \rVert

    over the centres c drawn so far. This is the greedy variant: of 2 + ln k samples drawn that way, the one
    that leaves the smallest sum of D² becomes the centre.

    Parameters
    ----------
    X : ndarray of shape (n_samples, n_features)
        Samples, with at least ``n_clusters`` distinct ones.
    n_clusters : int
        Number of centres k.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    ndarray of shape (n_clusters, n_features)
        Samples of ``X``, all distinct.
    """
    n_candidates = 2 + int(np.log(n_clusters))
    first = rng.integers(len(X))
    chosen = [first]
    nearest = cdist(X[[first]], X, "sqeuclidean")[0]
    while len(chosen) < n_clusters:
        candidates = _draw_in_proportion(nearest, n_candidates, rng)
        nearest_if_chosen = np.minimum(nearest, cdist(X[candidates], X, "sqeuclidean"))
        best = nearest_if_chosen.sum(axis=1).argmin()
        chosen.append(candidates[best])
        nearest = nearest_if_chosen[best]
    return X[chosen]


def _draw_in_proportion(weights: np.ndarray, size: int, rng: np.random.Generator) -> np.ndarray:
    """Draw ``size`` indices, index i with probability ``weights[i] / weights.sum()``."""
    if not weights.any():  # distances so small that their squares are lost to rounding
        return rng.integers(len(weights), size=size)
    cumulative = np.cumsum(weights / weights.max())
    drawn = np.searchsorted(cumulative, rng.uniform(size=size) * cumulative[-1], side="right")
    # A draw that rounds up to the total goes to the last index that has a weight.
    return np.minimum(drawn, np.searchsorted(cumulative, cumulative[-1]))


def nearest_center(X: np.ndarray, centers: np.ndarray) -> np.ndarray:
    r"""Assign each sample to its nearest centre (the first of equally near ones).

    .. math:: l_i = \operatorname{argmin}_k \lVert x_i - c_k \rVert^2
    """
    return cdist(centers, X, "sqeuclidean").argmin(axis=0)


def mean_of_clusters(X: np.ndarray, labels: np.ndarray, n_clusters: int) -> np.ndarray:
    r"""Move each centre to the mean of its samples; no cluster may be empty.

    .. math:: c_k = \frac{1}{|\{i : l_i = k\}|} \sum_{i : l_i = k} x_i
    """
    counts = np.bincount(labels, minlength=n_clusters)
    sums = [np.bincount(labels, weights=feature, minlength=n_clusters) for feature in X.T]
    return np.stack(sums, axis=1) / counts[:, None]


def empty_clusters(labels: np.ndarray, n_clusters: int) -> np.ndarray:
    """Return the indices of the clusters without samples."""
    return np.flatnonzero(np.bincount(labels, minlength=n_clusters) == 0)


def refill_empty_clusters(X: np.ndarray, labels: np.ndarray, centers: np.ndarray) -> np.ndarray:
    """Give each empty cluster the sample that is farthest from its own centre, and not alone with it."""
    empties = empty_clusters(labels, len(centers))
    if not len(empties):
        return labels
    labels = labels.copy()
    distances = ((X - centers[labels]) ** 2).sum(axis=1)
    for empty in empties:
        counts = np.bincount(labels, minlength=len(centers))
        farthest = np.where(counts[labels] > 1, distances, -1.0).argmax()
        labels[farthest] = empty
        distances[farthest] = 0.0
    return labels


def occupied_centers(X: np.ndarray, centers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return centres that all have samples, and the labels that go with them.

    Lloyd's last step can, rarely, leave a centre that is nearest to no sample; it jumps onto the sample that
    is farthest from its centre, which lowers the inertia.
    """
    labels = nearest_center(X, centers)
    while len(empties := empty_clusters(labels, len(centers))):
        distances = ((X - centers[labels]) ** 2).sum(axis=1)
        if not distances.any():  # samples so close together that squared distances are lost to rounding
            break
        centers = centers.copy()
        centers[empties[0]] = X[distances.argmax()]
        labels = nearest_center(X, centers)
    return centers, labels


def lloyd(X: np.ndarray, centers: np.ndarray, max_iter: int, tol: float, record_history: bool) -> LloydRun:
    r"""Assign samples and move centres in turns, from given centres until nothing changes.

    It ends when no label changes, when the summed squared movement of the centres is at most ``tol`` times
    the mean variance of the features, or after ``max_iter`` turns. What falls is the inertia

    .. math:: J = \sum_i \lVert x_i - c_{l_i} \rVert^2

    Parameters
    ----------
    X : ndarray of shape (n_samples, n_features)
        Samples.
    centers : ndarray of shape (n_clusters, n_features)
        First centres.
    max_iter : int
        Largest number of turns.
    tol : float
        Relative tolerance, as above.
    record_history : bool
        Whether to keep centres and labels of each turn.

    Returns
    -------
    LloydRun
        Centres, labels that fit these centres, inertia, number of turns, history.
    """
    n_clusters = len(centers)
    enough = tol * X.var(axis=0).mean()
    history = []
    previous_labels: np.ndarray | None = None
    n_iter = 0
    while n_iter < max_iter:
        n_iter += 1
        labels = nearest_center(X, centers)
        if record_history:
            history.append(KMeansStep(centers, labels))
        if previous_labels is not None and np.array_equal(labels, previous_labels):
            break
        previous_labels = labels
        moved = mean_of_clusters(X, refill_empty_clusters(X, labels, centers), n_clusters)
        shift = ((moved - centers) ** 2).sum()
        centers = moved
        if shift <= enough:
            break
    centers, labels = occupied_centers(X, centers)
    if record_history:
        history.append(KMeansStep(centers, labels))
    inertia = float(((X - centers[labels]) ** 2).sum())
    return LloydRun(centers, labels, inertia, n_iter, history)


class KMeans(ClassNamePrefixFeaturesOutMixin, TransformerMixin, ClusterMixin, BaseEstimator):
    r"""K-Means clustering: k centres that make the sum of squared distances to the nearest centre small.

    Lloyd's algorithm runs from several starts, and the run with the smallest inertia is kept.

    Parameters
    ----------
    n_clusters : int
        Number of clusters k, at most the number of distinct samples.
    init : {"k-means++", "random"} or array-like of shape (n_clusters, n_features)
        How first centres are drawn, or the first centres themselves (then there is one start).
    n_init : int
        Number of starts.
    max_iter : int
        Largest number of iterations of one start.
    tol : float
        A start is over when the summed squared movement of its centres is at most ``tol`` times the mean
        variance of the features.
    random_state : int, numpy.random.SeedSequence, numpy.random.RandomState or None
        Seed; ``None`` gives different results each time.
    record_history : bool
        Whether to keep every iteration of the best start in ``history_``.

    Attributes
    ----------
    cluster_centers_ : ndarray of shape (n_clusters, n_features)
        Centres, in the unit of ``X``.
    labels_ : ndarray of shape (n_samples,), int
        Index of the nearest centre for each sample.
    inertia_ : float
        Sum of the squared distances of samples to their centres.
    n_iter_ : int
        Iterations of the best start.
    history_ : list of KMeansStep
        Centres and labels of each iteration, the last one being the result; only with ``record_history``.
    n_features_in_ : int
        Number of features.

    Examples
    --------
    >>> import numpy as np
    >>> heights = np.array([[0.0], [0.01], [0.3], [0.31]])
    >>> KMeans(n_clusters=2).fit(heights).cluster_centers_.ravel().round(3).tolist()
    [0.305, 0.005]
    """

    def __init__(
        self,
        n_clusters: int = 8,
        *,
        init: str | ArrayLike = "k-means++",
        n_init: int = 10,
        max_iter: int = 300,
        tol: float = 1e-4,
        random_state: Seed | np.random.RandomState | None = 0,
        record_history: bool = False,
    ) -> None:
        self.n_clusters = n_clusters
        self.init = init
        self.n_init = n_init
        self.max_iter = max_iter
        self.tol = tol
        self.random_state = random_state
        self.record_history = record_history

    def fit(self, X: ArrayLike, y: Any = None) -> KMeans:
        """Find the centres.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Samples: finite, at least two, not all equal.
        y : None
            Not used; scikit-learn's conventions ask for it.

        Returns
        -------
        KMeans
            This estimator, fitted.

        Raises
        ------
        ValueError
            If ``X`` is not as above or has fewer than ``n_clusters`` distinct samples, or an argument is out
            of range.
        TypeError
            If an argument has the wrong type.
        """
        samples = training_samples(self, X)
        self._check_arguments(samples)
        runs = (
            lloyd(samples, centers, self.max_iter, self.tol, self.record_history) for centers in self._starts(samples)
        )
        best = min(runs, key=lambda run: run.inertia)
        self.cluster_centers_ = best.centers
        self.labels_ = best.labels
        self.inertia_ = best.inertia
        self.n_iter_ = best.n_iter
        self.__dict__.pop("history_", None)  # of an earlier fit
        if self.record_history:
            self.history_ = best.history
        self._n_features_out = len(best.centers)
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Return the index of the nearest centre for each sample.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Samples, finite.

        Returns
        -------
        ndarray of shape (n_samples,), int
            Indices into ``cluster_centers_``.

        Raises
        ------
        ValueError
            If ``X`` is not finite, empty, or has another number of features than the training samples.
        """
        return nearest_center(self._new_samples(X), self.cluster_centers_)

    def transform(self, X: ArrayLike) -> np.ndarray:
        """Return the distance of each sample to each centre.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Samples, finite.

        Returns
        -------
        ndarray of shape (n_samples, n_clusters)
            Euclidean distances, in the unit of ``X``.

        Raises
        ------
        ValueError
            If ``X`` is not finite, empty, or has another number of features than the training samples.
        """
        return cdist(self._new_samples(X), self.cluster_centers_)

    def _new_samples(self, X: ArrayLike) -> np.ndarray:
        check_is_fitted(self)
        return validate_data(self, X, dtype=np.float64, reset=False)

    def _check_arguments(self, X: np.ndarray) -> None:
        whole_number("n_init", self.n_init, low=1)
        whole_number("max_iter", self.max_iter, low=1)
        finite_number("tol", self.tol, low=0)
        whole_number("n_clusters", self.n_clusters, low=1)
        if self.n_clusters > (distinct := count_distinct(X)):
            raise ValueError(
                f"n_clusters must be at most {distinct}, the number of distinct samples in X, not {self.n_clusters}."
            )

    def _starts(self, X: np.ndarray) -> list[np.ndarray]:
        """First centres of every start."""
        if not isinstance(self.init, str):
            return [self._given_centers(X)]
        one_of("init", self.init, ["k-means++", "random"])
        draw = kmeans_plus_plus if self.init == "k-means++" else random_centers
        rng = random_generator(self.random_state)
        return [draw(X, self.n_clusters, rng) for _ in range(self.n_init)]

    def _given_centers(self, X: np.ndarray) -> np.ndarray:
        centers = finite_array("init", self.init)
        expected = (self.n_clusters, X.shape[1])
        if centers.shape != expected:
            raise ValueError(
                f"init must have one row a cluster and one column a feature, shape {expected}, not {centers.shape}."
            )
        return centers
