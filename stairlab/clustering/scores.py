"""How good a clustering is: silhouette (Rousseeuw 1987) and Davies-Bouldin index (Davies and Bouldin 1979).

The silhouette needs the distance of every sample to every other one, which is most of its cost. These
distances do not depend on the labels, so :func:`silhouette_scores` computes them once for any number of
clusterings of the same samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array, vstack
from scipy.spatial.distance import cdist

from stairlab._validation import finite_array

CHUNK_BYTES = 8_000_000
""" Memory for the distances that are held at a time [bytes] """


@dataclass(frozen=True)
class Labeling:
    """One clustering of the samples, with clusters renamed to 0, 1, ... in sorted order."""

    labels: np.ndarray
    """Cluster of each sample, shape (n_samples,)."""
    counts: np.ndarray
    """Number of samples of each cluster, shape (n_clusters,)."""

    def membership(self) -> csr_array:
        """Return the sparse matrix (n_clusters, n_samples) that is 1 where a sample is in a cluster."""
        n_samples = len(self.labels)
        ones = np.ones(n_samples)
        return csr_array((ones, (self.labels, np.arange(n_samples))), shape=(len(self.counts), n_samples))


def silhouette_scores(X: ArrayLike, labelings: Sequence[ArrayLike]) -> np.ndarray:
    r"""Mean silhouette of each of several clusterings of the same samples, from one set of distances.

    With the distances D between samples and the membership matrix M (M_ci is 1 if sample i is in cluster c),
    the product M D holds the summed distance of each sample to each cluster, for every clustering at once
    when their matrices are stacked. D is computed in chunks of columns, so that memory grows with the number
    of samples and not with its square.

    Parameters
    ----------
    X : array-like of shape (n_samples, n_features)
        Samples, finite.
    labelings : sequence of array-like of shape (n_samples,)
        Cluster of each sample, by any names; one array for each clustering, with 2 to n_samples - 1 clusters.

    Returns
    -------
    ndarray of shape (len(labelings),)
        Mean of :func:`silhouette_samples` for each clustering, between -1 and 1; larger is better.

    Raises
    ------
    ValueError
        If ``X`` is not finite, or ``labelings`` are not as above.

    Examples
    --------
    >>> X = [[0.0], [0.1], [1.0], [1.1], [3.0]]
    >>> silhouette_scores(X, [[0, 0, 1, 1, 2], [0, 0, 0, 0, 1]]).round(2).tolist()
    [0.72, 0.56]
    """
    X = finite_array("X", X)
    checked = [_labeling(f"labelings[{i}]", labels, len(X)) for i, labels in enumerate(labelings)]
    if not checked:
        raise ValueError("labelings must hold at least one clustering, not none.")
    return _silhouettes(X, checked).mean(axis=1)


def silhouette_score(X: ArrayLike, labels: ArrayLike) -> float:
    """Mean silhouette of one clustering.

    Parameters
    ----------
    X : array-like of shape (n_samples, n_features)
        Samples, finite.
    labels : array-like of shape (n_samples,)
        Cluster of each sample, by any names; 2 to n_samples - 1 clusters.

    Returns
    -------
    float
        Mean of :func:`silhouette_samples`, between -1 and 1; larger is better.

    Raises
    ------
    ValueError
        If ``X`` is not finite, or ``labels`` are not as above.
    """
    return float(silhouette_samples(X, labels).mean())


def silhouette_samples(X: ArrayLike, labels: ArrayLike) -> np.ndarray:
    r"""Silhouette of each sample: how much nearer it is to its own cluster than to the next one.

    .. math:: s_i = \frac{b_i - a_i}{\max(a_i, b_i)}

    where a_i is the mean distance of sample i to the others of its cluster, and b_i the smallest, over the
    other clusters, of the mean distances to their samples. A sample that is alone in its cluster has s_i = 0.

    Parameters
    ----------
    X : array-like of shape (n_samples, n_features)
        Samples, finite.
    labels : array-like of shape (n_samples,)
        Cluster of each sample, by any names; 2 to n_samples - 1 clusters.

    Returns
    -------
    ndarray of shape (n_samples,)
        Silhouettes, between -1 and 1; larger is better.

    Raises
    ------
    ValueError
        If ``X`` is not finite, or ``labels`` are not as above.
    """
    X = finite_array("X", X)
    return _silhouettes(X, [_labeling("labels", labels, len(X))])[0]


def davies_bouldin_score(X: ArrayLike, labels: ArrayLike) -> float:
    r"""Davies-Bouldin index: how wide clusters are, measured by how far apart their centres are.

    .. math:: DB = \frac{1}{k} \sum_{i=1}^{k} \max_{j \ne i} \frac{S_i + S_j}{\lVert c_i - c_j \rVert}

    where c_i is the mean of cluster i and S_i the mean distance of its samples to c_i. As in scikit-learn, it
    is 0 if all S_i or all distances between centres are 0 (within 1e-8), and pairs of clusters with the same
    centre do not enter the maximum. A sample that is alone in its cluster has exactly S_i = 0; rounding leaves
    scikit-learn's at some 1e-8 of the sample's distance from the origin.

    Parameters
    ----------
    X : array-like of shape (n_samples, n_features)
        Samples, finite.
    labels : array-like of shape (n_samples,)
        Cluster of each sample, by any names; 2 to n_samples - 1 clusters.

    Returns
    -------
    float
        The index, 0 or more; smaller is better.

    Raises
    ------
    ValueError
        If ``X`` is not finite, or ``labels`` are not as above.
    """
    X = finite_array("X", X)
    labeling = _labeling("labels", labels, len(X))
    means = labeling.membership() @ X / labeling.counts[:, None]
    to_mean = np.sqrt(((X - means[labeling.labels]) ** 2).sum(axis=1))
    widths = labeling.membership() @ to_mean / labeling.counts
    between = cdist(means, means)
    if np.allclose(widths, 0) or np.allclose(between, 0):
        return 0.0
    between[between == 0] = np.inf
    return float(((widths[:, None] + widths) / between).max(axis=1).mean())


def _labeling(name: str, labels: ArrayLike, n_samples: int) -> Labeling:
    array = np.asarray(labels)
    if array.shape != (n_samples,):
        raise ValueError(f"{name} must hold one label a sample, shape ({n_samples},), not {array.shape}.")
    names, renamed, counts = np.unique(array, return_inverse=True, return_counts=True)
    if not 2 <= len(names) <= n_samples - 1:
        raise ValueError(f"{name} must have 2 to n_samples - 1 = {n_samples - 1} clusters, not {len(names)}.")
    return Labeling(renamed, counts)


def _silhouettes(X: np.ndarray, labelings: list[Labeling]) -> np.ndarray:
    """Silhouettes of shape (len(labelings), n_samples)."""
    result = np.empty((len(labelings), len(X)))
    for chunk, sums in _summed_distances(X, labelings):
        for row, labeling, own_sums in zip(result, labelings, sums, strict=True):
            row[chunk] = _silhouettes_of_chunk(labeling.labels[chunk], labeling.counts, own_sums)
    return result


def _summed_distances(X: np.ndarray, labelings: list[Labeling]) -> Iterator[tuple[slice, list[np.ndarray]]]:
    """Yield chunks of samples with, for each labeling, their summed distances (n_clusters, chunk)."""
    memberships = vstack([labeling.membership() for labeling in labelings], format="csr")
    borders = np.cumsum([len(labeling.counts) for labeling in labelings])[:-1]
    size = max(1, CHUNK_BYTES // (len(X) * X.itemsize))
    for start in range(0, len(X), size):
        chunk = slice(start, start + size)
        yield chunk, np.split(memberships @ cdist(X, X[chunk]), borders)


def _silhouettes_of_chunk(labels: np.ndarray, counts: np.ndarray, sums: np.ndarray) -> np.ndarray:
    """Silhouettes of a chunk of samples from their summed distances (n_clusters, chunk) to clusters."""
    own = labels, np.arange(len(labels))
    a = sums[own] / np.maximum(counts[labels] - 1, 1)
    means = sums / counts[:, None]
    means[own] = np.inf
    b = means.min(axis=0)
    larger = np.maximum(a, b)
    alone = counts[labels] == 1
    return np.where(alone | (larger == 0), 0.0, (b - a) / np.where(larger == 0, 1.0, larger))
