"""Measure stairlab.clustering against scikit-learn and against itself; run as ``python benchmarks/clustering.py``.

Every ratio comes from one run, in which the two sides take turns. Smaller than the aim is better unless it says "at least".
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import sklearn.cluster
import sklearn.metrics
from scipy.spatial.distance import cdist
from threadpoolctl import threadpool_limits

from stairlab.clustering import KMeans, RobustGrowingNeuralGas, silhouette_score, silhouette_scores

RANGE_OF_K = range(2, 11)


class Row(NamedTuple):
    what: str
    measured: str
    aim: str
    detail: str


def blobs(seed: int, n: int = 2000, k: int = 6, spread: float = 0.6) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform(-5, 5, size=(k, 2))[rng.integers(k, size=n)] + spread * rng.normal(size=(n, 2))


def with_outliers(X: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Replace 5 % of the samples by outliers 10 standard deviations away; return all samples and the clean ones."""
    rng = np.random.default_rng(seed)
    replaced = rng.choice(len(X), len(X) // 20, replace=False)
    angle = rng.uniform(0, 2 * np.pi, size=len(replaced))
    dirty = X.copy()
    dirty[replaced] = X.mean(axis=0) + 10 * X.std(axis=0) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return dirty, np.delete(X, replaced, axis=0)


def varied_data(seed: int) -> tuple[np.ndarray, int]:
    """Blobs, uniform, skewed and curved samples, 50 to 1,000 of them in 1 to 6 dimensions, and a number of clusters."""
    rng = np.random.default_rng(seed)
    n, dimensions, k = int(rng.integers(50, 1000)), int(rng.integers(1, 7)), int(rng.integers(2, 11))
    t = rng.uniform(0, 6, size=n)
    kinds = [
        4 * rng.normal(size=(k, dimensions))[rng.integers(k, size=n)] + rng.normal(size=(n, dimensions)),
        rng.uniform(size=(n, dimensions)),
        rng.lognormal(size=(n, dimensions)),
        np.sin(np.outer(t, np.arange(1, dimensions + 1))) + 0.1 * rng.normal(size=(n, dimensions)),
    ]
    return kinds[seed % 4], k


def mean_distance(X: np.ndarray, centers: np.ndarray) -> float:
    return cdist(X, centers).min(axis=1).mean()


def seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def choosing_k(repetitions: int = 7) -> list[Row]:
    """K-Means with ten starts and the silhouette for k = 2 to 10 on 2,000 samples, by us and by scikit-learn."""
    X = blobs(0)

    def ours() -> None:
        silhouette_scores(X, [KMeans(k, n_init=10).fit(X).labels_ for k in RANGE_OF_K])

    def theirs() -> None:
        for k in RANGE_OF_K:
            labels = sklearn.cluster.KMeans(k, n_init=10, random_state=0).fit(X).labels_
            sklearn.metrics.silhouette_score(X, labels)

    def theirs_on_one_thread() -> None:
        with threadpool_limits(1):
            theirs()

    sides = [ours, theirs, theirs_on_one_thread]
    times = np.array([[seconds(side) for side in sides] for _ in range(repetitions + 1)][1:])
    us, all_threads, one_thread = np.median(times, axis=0)
    return [
        Row(
            f"choosing k, time against scikit-learn ({name})",
            f"{us / them:.2f}",
            "1, better 0.5",
            f"{us:.3f} s / {them:.3f} s",
        )
        for name, them in [("its threads", all_threads), ("one thread", one_thread)]
    ]


def inertia_of_own_starts() -> list[Row]:
    ratios = []
    for seed in range(50):
        X, k = varied_data(seed)
        theirs = sklearn.cluster.KMeans(k, n_init=10, random_state=seed).fit(X)
        ratios.append(KMeans(k, n_init=10, random_state=seed).fit(X).inertia_ / theirs.inertia_)
    detail = f"50 data sets, worst {max(ratios):.4f}"
    return [Row("K-Means, inertia against scikit-learn, median", f"{np.median(ratios):.6f}", "1.001", detail)]


def memory_of_silhouette() -> list[Row]:
    X = blobs(0, n=10_000)
    labels = KMeans(6, n_init=1).fit(X).labels_
    tracemalloc.start()
    score = silhouette_score(X, labels)
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    difference = abs(score - sklearn.metrics.silhouette_score(X, labels))
    return [Row("silhouette of 10,000 samples, peak memory", f"{peak:.0f} MB", "500 MB", f"off by {difference:.0e}")]


TIME_RGNG = """
import time, numpy as np
from stairlab.clustering import RobustGrowingNeuralGas
X = np.random.default_rng(0).normal(size=({n}, 2))
RobustGrowingNeuralGas(2, n_passes=1).fit(X[:20])
times = []
for _ in range({repetitions}):
    start = time.perf_counter()
    RobustGrowingNeuralGas(10).fit(X)
    times.append(time.perf_counter() - start)
print(np.median(times))
"""


def time_of_rgng(n: int, compiled: bool, repetitions: int) -> float:
    """Median time in a process of its own, as Numba reads its switch when it is imported."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": str(int(not compiled))}
    command = [sys.executable, "-c", TIME_RGNG.format(n=n, repetitions=repetitions)]
    return float(subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout)


def compiler_off(n: int = 1000) -> list[Row]:
    stepped, compiled = time_of_rgng(n, False, 1), time_of_rgng(n, True, 11)
    detail = f"{stepped:.1f} s / {compiled:.3f} s, {n} samples, up to 10 nodes"
    return [Row("RGNG, time with the compiler off against on", f"{stepped / compiled:.0f}", "at least 50", detail)]


def rgng_on_clean_data() -> list[Row]:
    ratios = []
    for seed in range(20):
        X = blobs(seed, n=[100, 300, 1000][seed % 3], k=3 + seed % 4)
        nodes = RobustGrowingNeuralGas(random_state=seed).fit(X).nodes_
        ratios.append(mean_distance(X, nodes) / mean_distance(X, KMeans(len(nodes)).fit(X).cluster_centers_))
    detail = f"20 data sets, median {np.median(ratios):.3f}"
    return [Row("RGNG, distance to nodes against K-Means, worst", f"{max(ratios):.3f}", "1.05", detail)]


def rgng_with_outliers() -> list[Row]:
    growths = []
    for seed in range(20):
        X = blobs(seed, n=[100, 300, 1000][seed % 3], k=3 + seed % 4)
        dirty, clean = with_outliers(X, seed)
        nodes = [RobustGrowingNeuralGas(random_state=seed).fit(data).nodes_ for data in (X, dirty)]
        centers = [KMeans(len(n)).fit(data).cluster_centers_ for n, data in zip(nodes, (X, dirty), strict=True)]
        growths.append(
            [mean_distance(clean, after) / mean_distance(clean, before) for before, after in (nodes, centers)]
        )
    ours, k_means = np.median(growths, axis=0)
    detail = "20 data sets, median"
    return [
        Row("RGNG, growth of the clean samples' distance by outliers", f"{ours:.3f}", f"K-Means {k_means:.3f}", detail)
    ]


def main() -> None:
    benchmarks = [
        choosing_k,
        inertia_of_own_starts,
        memory_of_silhouette,
        compiler_off,
        rgng_on_clean_data,
        rgng_with_outliers,
    ]
    print(f"{'what':<60} {'measured':>10}   {'aim':<15} detail", flush=True)
    for benchmark in benchmarks:
        for row in benchmark():
            print(f"{row.what:<60} {row.measured:>10}   {row.aim:<15} {row.detail}", flush=True)


if __name__ == "__main__":
    main()
