r"""Robust growing neural gas (RGNG) from scratch: Qin and Suganthan, Neural Networks 17 (2004), 1135-1148.

A growing neural gas is a network of a few nodes (prototypes) that moves into the data: each sample pulls the
nearest node and, a little, that node's neighbours. RGNG makes it robust against the order of the samples, the
first nodes and outliers. Its parts, and where to find them:

(a) growth from two nodes to the maximum, some passes over the shuffled samples for each size:
    :func:`first_network`, :func:`train_size`, :func:`train_pass`
(b) learning rates that fall with a node's age: :func:`learning_rate`
(c) outlier resistance by restricting distances: :func:`harmonic_mean_distances`, :func:`restrict`,
    :func:`attract`
(d) neighbours move too, and are pushed away from the winner: :func:`move_neighbours`, :func:`repel`
(e) edges join winner and runner-up, age and are pruned: :func:`refresh_edges`, :func:`prune`
(f) a new node where the weighted error is largest: :func:`node_errors`, :func:`insert_node`
(g) of all sizes, the network with the smallest description length: :func:`description_length`

:meth:`RobustGrowingNeuralGas.fit` puts them together. Functions under ``@njit`` are compiled by Numba when
they are first called. With the environment variable ``NUMBA_DISABLE_JIT=1`` they run as plain Python and can
be stepped through in a debugger.

Choices that the published description leaves open, or that differ from it:

- *Unit.* Samples are centred and divided by their standard deviation (one number for all features) before
  training and the nodes are put back afterwards, so that settings which are lengths do not depend on the unit
  of the data. On standardised data, as the paper on action prototypes uses, this changes nothing.
- *Repulsion.* The push of (d) is multiplied by the neighbour's learning rate, as the pull is. Without this
  factor it keeps nodes apart that are nearer than a few ``repulsion_decay``: with ten nodes, samples are then
  7 % farther from their nearest node than with K-Means, instead of 3 % (mean of 16 data sets).
- *Restricting distance.* Only the winner's follows, as only the winner stands for the sample. If the
  neighbours' follow too, they grow to the distance between nodes and hardly restrict: with two to five nodes,
  samples are then 2.6 % farther from their nearest node than with K-Means, instead of 1.1 %.
- *Error of a node.* A sample counts with its distance up to the harmonic mean distance, and with that beyond.
- *Termination.* Pruning can take away what growth adds, so there are at most 2 ``max_nodes`` insertions.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist
from sklearn.base import BaseEstimator, ClusterMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from stairlab._validation import Seed, finite_number, whole_number
from stairlab.clustering._common import LARGEST, count_distinct, random_generator, training_samples

NO_EDGE = -1
"""What ``Network.ages`` holds where there is no edge."""
MAX_INSERTIONS = 2
"""Largest number of insertions, as a multiple of ``max_nodes``: pruning can take away what growth adds."""
COINCIDENT = 1e-12
"""Points nearer than this are one point [standard deviations of the data]."""


class Settings(NamedTuple):
    """Constants of one training; compiled functions get its plain numbers and pairs."""

    max_nodes: int
    winner_rates: tuple[float, float]
    """Initial and final learning rate of winners."""
    neighbour_rates: tuple[float, float]
    """Initial and final learning rate of neighbours."""
    repulsion: tuple[float, float]
    """Strength and decay of the push between neighbours."""
    max_edge_age: int
    n_passes: int
    tol: float


class Network(NamedTuple):
    """State of the network: arrays for ``max_nodes`` nodes, of which n are in use, the oldest first."""

    nodes: np.ndarray
    """Positions of the nodes, shape (max_nodes, n_features)."""
    ages: np.ndarray
    """Age of the edge between two nodes [wins of its ends], or NO_EDGE; (max_nodes, max_nodes), symmetric."""
    restricting: np.ndarray
    """Restricting distance of each node, shape (max_nodes,)."""


@njit(cache=True)
def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Return the Euclidean distance between two points."""
    total = 0.0
    for j in range(len(a)):
        total += (a[j] - b[j]) ** 2
    return np.sqrt(total)


@njit(cache=True)
def move(node: np.ndarray, length: float, target: np.ndarray, gap: float) -> None:
    """Move ``node`` in place by ``length`` towards ``target`` (away if negative), ``gap`` > 0 from it."""
    for j in range(len(node)):
        node[j] += length * (target[j] - node[j]) / gap


@njit(cache=True)
def nearest_two(x: np.ndarray, nodes: np.ndarray, n: int) -> tuple[int, int]:
    """Return winner and runner-up: the nodes nearest and second nearest to the sample ``x``."""
    winner, runner_up = -1, -1
    nearest, second = np.inf, np.inf
    for i in range(n):
        gap = distance(x, nodes[i])
        if gap < nearest:
            runner_up, second = winner, nearest
            winner, nearest = i, gap
        elif gap < second:
            runner_up, second = i, gap
    return winner, runner_up


@njit(cache=True)
def learning_rate(rates: tuple[float, float], node: int, n: int, max_nodes: int) -> float:
    r"""(b) Learning rate of a node, between an initial and a final one: the older the node, the lower.

    .. math:: \varepsilon = \varepsilon_i (\varepsilon_f / \varepsilon_i)^{(r - 1) / n_\max}

    where the rank r counts from the newest node, which has r = 1.
    """
    initial, final = rates
    rank = n - node
    return initial * (final / initial) ** ((rank - 1) / max_nodes)


@njit(cache=True)
def restrict(gap: float, restricting: float) -> tuple[float, float]:
    r"""(c) How strongly a sample pulls a node, and how the node's restricting distance follows.

    A sample at the distance g pulls with the strength sigma, and the restricting distance d becomes d':

    .. math::
        g > d: \quad & d' = \frac{2}{1/d + 1/g}, & \sigma = d' \\
        g \le d: \quad & d' = \frac{d + g}{2}, & \sigma = g

    So a pull is never stronger than 2 d, however far the sample: an outlier cannot drag the node away.
    """
    if gap > restricting:
        bounded = 2.0 / (1.0 / restricting + 1.0 / gap)
        return bounded, bounded
    return gap, 0.5 * (restricting + gap)


@njit(cache=True)
def attract(node: np.ndarray, restricting: float, x: np.ndarray, rate: float) -> float:
    r"""(c) Pull a node in place towards the sample ``x`` by the bounded strength sigma of :func:`restrict`.

    .. math:: w_i \leftarrow w_i + \varepsilon \, \sigma_i \frac{x - w_i}{\lVert x - w_i \rVert}

    Returns the restricting distance that follows from this sample.
    """
    gap = distance(x, node)
    if gap < COINCIDENT:
        return restricting
    pull, following = restrict(gap, restricting)
    move(node, rate * pull, x, gap)
    return following


@njit(cache=True)
def repel(node: np.ndarray, winner: np.ndarray, strength: float, decay: float) -> None:
    r"""(d) Push a neighbour in place away from the winner, so that nodes do not coincide.

    .. math:: w_i \leftarrow w_i + \varepsilon \, \beta \, \bar l \, e^{-\lVert w_i - w_s \rVert / \zeta} \,
              \frac{w_i - w_s}{\lVert w_i - w_s \rVert}

    ``strength`` is the product of the learning rate, beta (``repulsion``) and the mean length of the winner's
    edges; ``decay`` is zeta (``repulsion_decay``).
    """
    gap = distance(node, winner)
    if gap > COINCIDENT:
        move(node, -strength * np.exp(-gap / decay), winner, gap)


@njit(cache=True)
def count_edges(ages: np.ndarray, i: int, n: int) -> int:
    """Return the number of edges of node i."""
    count = 0
    for j in range(n):
        if ages[i, j] != NO_EDGE:
            count += 1
    return count


@njit(cache=True)
def mean_edge_length(nodes: np.ndarray, ages: np.ndarray, winner: int, n: int) -> float:
    """Return the mean distance of the winner to its neighbours."""
    total = 0.0
    for i in range(n):
        if ages[winner, i] != NO_EDGE:
            total += distance(nodes[winner], nodes[i])
    return total / count_edges(ages, winner, n)


@njit(cache=True)
def move_neighbours(
    nodes: np.ndarray,
    ages: np.ndarray,
    restricting: np.ndarray,
    x: np.ndarray,
    winner: int,
    n: int,
    rates: tuple[float, float],
    repulsion: tuple[float, float],
) -> None:
    """(d) Pull every neighbour of the winner towards the sample, and push it away from the winner."""
    strength, decay = repulsion
    edge_length = mean_edge_length(nodes, ages, winner, n)
    for i in range(n):
        if ages[winner, i] != NO_EDGE:
            rate = learning_rate(rates, i, n, len(nodes))
            attract(nodes[i], restricting[i], x, rate)
            repel(nodes[i], nodes[winner], rate * strength * edge_length, decay)


@njit(cache=True)
def refresh_edges(ages: np.ndarray, winner: int, runner_up: int, n: int) -> None:
    """(e) Make the winner's edges one older, and join winner and runner-up by an edge of age 0."""
    for i in range(n):
        if ages[winner, i] != NO_EDGE:
            ages[winner, i] += 1
            ages[i, winner] += 1
    ages[winner, runner_up] = 0
    ages[runner_up, winner] = 0


@njit(cache=True)
def prune(nodes: np.ndarray, ages: np.ndarray, restricting: np.ndarray, winner: int, n: int, max_edge_age: int) -> int:
    """(e) Remove the winner's edges that are too old, and nodes without edges; return the number of nodes."""
    for i in range(n - 1, -1, -1):
        if ages[winner, i] > max_edge_age:
            ages[winner, i] = NO_EDGE
            ages[i, winner] = NO_EDGE
            if count_edges(ages, i, n) == 0:
                remove_node(nodes, ages, restricting, i, n)
                n -= 1
                if i < winner:
                    winner -= 1
    return n


@njit(cache=True)
def remove_node(nodes: np.ndarray, ages: np.ndarray, restricting: np.ndarray, i: int, n: int) -> None:
    """Close the gap that node i leaves, in place; the order by age stays."""
    for j in range(i, n - 1):
        nodes[j] = nodes[j + 1]
        restricting[j] = restricting[j + 1]
        ages[j, :] = ages[j + 1, :]
    for j in range(i, n - 1):
        ages[:, j] = ages[:, j + 1]
    ages[n - 1, :] = NO_EDGE
    ages[:, n - 1] = NO_EDGE


@njit(cache=True)
def train_pass(
    X: np.ndarray,
    order: np.ndarray,
    nodes: np.ndarray,
    ages: np.ndarray,
    restricting: np.ndarray,
    n: int,
    winner_rates: tuple[float, float],
    neighbour_rates: tuple[float, float],
    repulsion: tuple[float, float],
    max_edge_age: int,
) -> int:
    """(a) Show each sample once to the network, in the given order; return the number of nodes that are left.

    This is the sequential inner loop: every sample finds the network as the one before has left it. The
    arrays of the :class:`Network` are changed in place.
    """
    for j in order:
        x = X[j]
        winner, runner_up = nearest_two(x, nodes, n)
        refresh_edges(ages, winner, runner_up, n)
        rate = learning_rate(winner_rates, winner, n, len(nodes))
        restricting[winner] = attract(nodes[winner], restricting[winner], x, rate)
        move_neighbours(nodes, ages, restricting, x, winner, n, neighbour_rates, repulsion)
        n = prune(nodes, ages, restricting, winner, n, max_edge_age)
    return n


def harmonic_mean_distances(X: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    r"""(c) Harmonic mean of the distances of all samples to each node, its first restricting distance.

    .. math:: d_i(0) = \Big( \frac{1}{N} \sum_{j=1}^{N} \frac{1}{\lVert x_j - w_i \rVert} \Big)^{-1}

    Far samples hardly count in it. Samples that coincide with the node are left out, as they would make it
    zero.

    Parameters
    ----------
    X : ndarray of shape (n_samples, n_features)
        Samples, not all at one node [standard deviations of the data].
    nodes : ndarray of shape (n_nodes, n_features)
        Positions of the nodes [standard deviations of the data].

    Returns
    -------
    ndarray of shape (n_nodes,)
        Harmonic mean distances [standard deviations of the data].
    """
    distances = cdist(nodes, X)
    apart = distances > COINCIDENT
    inverse = np.divide(1.0, distances, where=apart, out=np.zeros_like(distances))
    return apart.sum(axis=1) / inverse.sum(axis=1)


def first_network(X: np.ndarray, max_nodes: int, rng: np.random.Generator) -> Network:
    """(a) Return a network of two nodes, joined by an edge, on two distinct samples drawn at random."""
    ages = np.full((max_nodes, max_nodes), NO_EDGE)
    ages[0, 1] = ages[1, 0] = 0
    nodes = np.zeros((max_nodes, X.shape[1]))
    nodes[0] = first = X[rng.integers(len(X))]
    others = X[(X - first).any(axis=1)]
    nodes[1] = others[rng.integers(len(others))]
    return Network(nodes, ages, np.zeros(max_nodes))


def node_errors(X: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    r"""(f) Error of each node: the distances of its samples, with far samples weighted down.

    .. math:: E_i = \sum_{x \in V_i} \min\Big(1, \frac{h_i}{\lVert x - w_i \rVert}\Big) \lVert x - w_i \rVert

    where V_i are the samples that are nearest to node i, and h_i is the harmonic mean of the distances of all
    samples to it (:func:`harmonic_mean_distances`). So an outlier counts no more than a sample at the
    distance h_i.

    Parameters
    ----------
    X : ndarray of shape (n_samples, n_features)
        Samples [standard deviations of the data].
    nodes : ndarray of shape (n_nodes, n_features)
        Positions of the nodes [standard deviations of the data].

    Returns
    -------
    ndarray of shape (n_nodes,)
        Errors [standard deviations of the data]; 0 for a node without samples.
    """
    distances = cdist(nodes, X)
    winners = distances.argmin(axis=0)
    weighted = np.minimum(distances.min(axis=0), harmonic_mean_distances(X, nodes)[winners])
    return np.bincount(winners, weights=weighted, minlength=len(nodes))


def insert_node(X: np.ndarray, network: Network, n: int) -> int:
    """(f) Put a new node halfway between the node with the largest error and its worst neighbour.

    The edge between these two gives way to edges from both to the new node. Returns the new number of nodes.
    """
    errors = node_errors(X, network.nodes[:n])
    worst = int(errors.argmax())
    neighbours = np.flatnonzero(network.ages[worst, :n] != NO_EDGE)
    neighbour = int(neighbours[errors[neighbours].argmax()])
    network.nodes[n] = (network.nodes[worst] + network.nodes[neighbour]) / 2
    network.ages[worst, neighbour] = network.ages[neighbour, worst] = NO_EDGE
    for end in (worst, neighbour):
        network.ages[end, n] = network.ages[n, end] = 0
    return n + 1


def description_length(X: np.ndarray, nodes: np.ndarray, accuracy: float, error_balance: float) -> float:
    r"""(g) Number of bits that it takes to write down nodes and samples: the smaller, the better the network.

    .. math:: L = m K + (N - |O|) \log_2 m + \kappa \sum_{x \notin O} \sum_j e_j(x) + |O| K

    with m nodes, N samples, :math:`e_j(x) = \max(\log_2 (|x_j - w_j| / \eta), 1)` for the nearest node w of
    x, and

    - :math:`K = \sum_j \log_2(\mathrm{range}_j / \eta)`, the bits of a point in the range of the data, known
      to the accuracy :math:`\eta`;
    - :math:`\log_2 m`, the bits that name the node of a sample, and e_j(x) those of what is left to it;
    - :math:`\kappa`, which balances errors against the size of the network;
    - O, the outliers: samples with :math:`\log_2 m + \sum_j e_j(x) > K`, which are shorter written by
      themselves.

    Parameters
    ----------
    X : ndarray of shape (n_samples, n_features)
        Samples [standard deviations of the data].
    nodes : ndarray of shape (n_nodes, n_features)
        Positions of the nodes [standard deviations of the data].
    accuracy : float
        Data accuracy eta [standard deviations of the data].
    error_balance : float
        Balance kappa.

    Returns
    -------
    float
        Description length [bits].
    """
    bits_of_point = np.log2(np.maximum(np.ptp(X, axis=0) / accuracy, 2.0)).sum()
    bits_of_name = np.log2(len(nodes))
    residuals = np.abs(X - nodes[nearest_node(X, nodes)])
    bits_of_error = np.log2(np.maximum(residuals / accuracy, 2.0)).sum(axis=1)
    outlier = bits_of_name + bits_of_error > bits_of_point
    bits_of_sample = np.where(outlier, bits_of_point, bits_of_name + error_balance * bits_of_error)
    return float(len(nodes) * bits_of_point + bits_of_sample.sum())


class RGNGStep(NamedTuple):
    """The network after one event of its training."""

    event: str
    """``"start"``, ``"pass"``, ``"insertion"`` (the last of ``nodes`` is new) or ``"trained"`` (a size)."""
    nodes: np.ndarray
    """Positions of the nodes, the oldest first, shape (n_nodes, n_features)."""
    edges: np.ndarray
    """Pairs of node indices, the smaller first, shape (n_edges, 2)."""
    errors: np.ndarray
    """Error of each node, :func:`node_errors`, shape (n_nodes,)."""


def snapshot(event: str, X: np.ndarray, network: Network, n: int) -> RGNGStep:
    """Return a copy of nodes and edges as they are now, with the nodes' errors."""
    nodes = network.nodes[:n].copy()
    edges = np.argwhere(np.triu(network.ages[:n, :n] != NO_EDGE, k=1))
    return RGNGStep(event, nodes, edges, node_errors(X, nodes))


class Recorder:
    """Keeps a snapshot of every event, or nothing if told so."""

    def __init__(self, X: np.ndarray, active: bool) -> None:
        self.X = X
        self.active = active
        self.steps: list[RGNGStep] = []

    def __call__(self, event: str, network: Network, n: int) -> None:
        """Note that ``event`` has happened to the network."""
        if self.active:
            self.steps.append(snapshot(event, self.X, network, n))


def train_size(
    X: np.ndarray, network: Network, n: int, settings: Settings, rng: np.random.Generator, record: Recorder
) -> tuple[int, int]:
    """(a) Train the network of one size until its nodes rest or all passes are done.

    Every pass has a new order of the samples and starts with fresh restricting distances (c). Returns the
    number of nodes that are left and the number of passes made.
    """
    n_passes = 0
    while n_passes < settings.n_passes:
        n_passes += 1
        before, n_before = network.nodes[:n].copy(), n
        network.restricting[:n] = harmonic_mean_distances(X, network.nodes[:n])
        n = train_pass(
            X,
            rng.permutation(len(X)),
            *network,
            n,
            settings.winner_rates,
            settings.neighbour_rates,
            settings.repulsion,
            settings.max_edge_age,
        )
        check_nodes(network.nodes[:n], settings)
        record("pass", network, n)
        if n == n_before and np.linalg.norm(network.nodes[:n] - before, axis=1).mean() < settings.tol:
            break
    return n, n_passes


def check_nodes(nodes: np.ndarray, settings: Settings) -> None:
    """Raise a ValueError if nodes have left the data, which takes a strong repulsion that decays slowly."""
    if not (np.abs(nodes) < LARGEST).all():
        raise ValueError(
            f"repulsion and repulsion_decay must let the nodes stay with the data, "
            f"but with {settings.repulsion[0]:g} and {settings.repulsion[1]:g} they ran away."
        )


def grow(
    X: np.ndarray, settings: Settings, rng: np.random.Generator, record: Recorder
) -> Iterator[tuple[RGNGStep, int]]:
    """(a) Grow the network from two nodes to the maximum; yield each trained size and its passes."""
    network, n = first_network(X, settings.max_nodes, rng), 2
    record("start", network, n)
    for _ in range(1 + MAX_INSERTIONS * settings.max_nodes):
        n, n_passes = train_size(X, network, n, settings, rng, record)
        yield snapshot("trained", X, network, n), n_passes
        if n == settings.max_nodes:
            return
        n = insert_node(X, network, n)
        record("insertion", network, n)


class Unit(NamedTuple):
    """The unit of training: data centred, and divided by one standard deviation for all features."""

    center: np.ndarray
    scale: float

    @classmethod
    def of(cls, X: np.ndarray) -> Unit:
        """Return the unit in which the mean variance of the features of ``X`` is 1."""
        return cls(X.mean(axis=0), float(np.sqrt(X.var(axis=0).mean())))

    def scaled(self, X: np.ndarray) -> np.ndarray:
        """Return ``X`` in this unit."""
        return np.ascontiguousarray((X - self.center) / self.scale)

    def restored(self, step: RGNGStep) -> RGNGStep:
        """Return ``step`` in the unit of the data."""
        return step._replace(nodes=step.nodes * self.scale + self.center, errors=step.errors * self.scale)


class RobustGrowingNeuralGas(ClusterMixin, BaseEstimator):
    """Robust growing neural gas: a few prototypes that outliers hardly move (Qin and Suganthan 2004).

    The network grows from two nodes to ``max_nodes`` and is trained at each size; of all sizes, the one that
    describes the data in the fewest bits is kept. So it may have fewer nodes than ``max_nodes``. The module's
    docstring says where each part of the algorithm is, and where this one differs from the published one.

    Parameters
    ----------
    max_nodes : int
        Largest number of nodes, at least 2. There are never more nodes than distinct samples.
    winner_rate_initial, winner_rate_final : float
        Learning rate of a winner that is new (epsilon_bi), and towards which it falls with age (epsilon_bf).
    neighbour_rate_initial, neighbour_rate_final : float
        The same for neighbours of the winner (epsilon_ni, epsilon_nf).
    repulsion : float
        Strength beta with which neighbours are pushed away from the winner.
    repulsion_decay : float
        Distance zeta over which this push decays [standard deviations of the data].
    max_edge_age : int
        Edges older than that are removed [wins of the node at one of the ends].
    n_passes : int
        Largest number of passes over the samples for each size of the network.
    accuracy : float
        Data accuracy eta in the description length [standard deviations of the data].
    error_balance : float
        Weight kappa of errors in the description length.
    tol : float
        A size is trained when a pass moves nodes by less than that on average [standard deviations of the
        data].
    random_state : int, numpy.random.SeedSequence, numpy.random.RandomState or None
        Seed; ``None`` gives different results each time.
    record_history : bool
        Whether to keep the network after every insertion and every pass in ``history_``.

    Attributes
    ----------
    nodes_ : ndarray of shape (n_nodes, n_features)
        Nodes of the kept network, the oldest first, in the unit of ``X``.
    edges_ : ndarray of shape (n_edges, 2), int
        Its edges as pairs of indices into ``nodes_``, the smaller index first.
    errors_ : ndarray of shape (n_nodes,)
        Error of each of its nodes, in the unit of ``X``.
    labels_ : ndarray of shape (n_samples,), int
        Index of the nearest node for each sample.
    mdl_ : dict of int to float
        Description length of the network of each size [bits].
    n_passes_ : int
        Passes made over the samples, in all.
    history_ : list of RGNGStep
        The network after each event; only with ``record_history``.
    n_features_in_ : int
        Number of features.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> motions = rng.normal(size=(60, 2)) * 0.1 + np.repeat([[-1.0, 0.0], [1.0, 0.0]], 30, axis=0)
    >>> network = RobustGrowingNeuralGas(max_nodes=2).fit(motions)
    >>> sorted(network.nodes_[:, 0].round().tolist())
    [-1.0, 1.0]
    """

    def __init__(
        self,
        max_nodes: int = 10,
        *,
        winner_rate_initial: float = 0.1,
        winner_rate_final: float = 0.01,
        neighbour_rate_initial: float = 0.005,
        neighbour_rate_final: float = 0.0005,
        repulsion: float = 2.0,
        repulsion_decay: float = 0.1,
        max_edge_age: int = 100,
        n_passes: int = 20,
        accuracy: float = 5e-6,
        error_balance: float = 1.2,
        tol: float = 1e-5,
        random_state: Seed | np.random.RandomState | None = 0,
        record_history: bool = False,
    ) -> None:
        self.max_nodes = max_nodes
        self.winner_rate_initial = winner_rate_initial
        self.winner_rate_final = winner_rate_final
        self.neighbour_rate_initial = neighbour_rate_initial
        self.neighbour_rate_final = neighbour_rate_final
        self.repulsion = repulsion
        self.repulsion_decay = repulsion_decay
        self.max_edge_age = max_edge_age
        self.n_passes = n_passes
        self.accuracy = accuracy
        self.error_balance = error_balance
        self.tol = tol
        self.random_state = random_state
        self.record_history = record_history

    def fit(self, X: ArrayLike, y: Any = None) -> RobustGrowingNeuralGas:
        """Grow and train the network, and keep the size with the smallest description length.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Samples: finite, at least two, not all equal.
        y : None
            Not used; scikit-learn's conventions ask for it.

        Returns
        -------
        RobustGrowingNeuralGas
            This estimator, fitted.

        Raises
        ------
        ValueError
            If ``X`` is not as above, or an argument is out of range.
        TypeError
            If an argument has the wrong type.
        """
        samples = training_samples(self, X)
        self._check_arguments()
        unit = Unit.of(samples)
        scaled = unit.scaled(samples)
        settings = self._settings(max_nodes=min(self.max_nodes, count_distinct(scaled)))
        record = Recorder(scaled, self.record_history)
        best, smallest = None, np.inf
        self.mdl_: dict[int, float] = {}
        self.n_passes_ = 0
        for trained, n_passes in grow(scaled, settings, random_generator(self.random_state), record):
            length = description_length(scaled, trained.nodes, self.accuracy, self.error_balance)
            size = len(trained.nodes)
            self.mdl_[size] = min(length, self.mdl_.get(size, np.inf))
            self.n_passes_ += n_passes
            if best is None or length < smallest:
                best, smallest = trained, length
        assert best is not None  # grow yields at least one size
        _, self.nodes_, self.edges_, self.errors_ = unit.restored(best)
        self.labels_ = nearest_node(samples, self.nodes_)
        self.__dict__.pop("history_", None)  # of an earlier fit
        if self.record_history:
            self.history_ = [unit.restored(step) for step in record.steps]
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Return the index of the nearest node for each sample.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Samples, finite.

        Returns
        -------
        ndarray of shape (n_samples,), int
            Indices into ``nodes_``.

        Raises
        ------
        ValueError
            If ``X`` is not finite, empty, or has another number of features than the training samples.
        """
        check_is_fitted(self)
        return nearest_node(validate_data(self, X, dtype=np.float64, reset=False), self.nodes_)

    def _check_arguments(self) -> None:
        whole_number("max_nodes", self.max_nodes, low=2)
        for name in (
            "winner_rate_initial",
            "winner_rate_final",
            "neighbour_rate_initial",
            "neighbour_rate_final",
        ):
            finite_number(name, getattr(self, name), above=0, high=1)
        for name in ("repulsion_decay", "accuracy", "error_balance"):
            finite_number(name, getattr(self, name), above=0)
        for name in ("repulsion", "tol"):
            finite_number(name, getattr(self, name), low=0)
        for name in ("max_edge_age", "n_passes"):
            whole_number(name, getattr(self, name), low=1)

    def _settings(self, max_nodes: int) -> Settings:
        return Settings(
            max_nodes=int(max_nodes),
            winner_rates=(float(self.winner_rate_initial), float(self.winner_rate_final)),
            neighbour_rates=(float(self.neighbour_rate_initial), float(self.neighbour_rate_final)),
            repulsion=(float(self.repulsion), float(self.repulsion_decay)),
            max_edge_age=int(self.max_edge_age),
            n_passes=int(self.n_passes),
            tol=float(self.tol),
        )


def nearest_node(X: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return the index of the nearest node for each sample."""
    return cdist(nodes, X).argmin(axis=0)
