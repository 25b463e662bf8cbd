"""Clustering from scratch, by scikit-learn's conventions. Nothing in here knows about robots.

Each module is one algorithm; names are imported when they are first used, so that K-Means does not wait for
Numba.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stairlab.clustering.histogram import HistogramBins
    from stairlab.clustering.kmeans import KMeans, KMeansStep
    from stairlab.clustering.rgng import RGNGStep, RobustGrowingNeuralGas
    from stairlab.clustering.scores import (
        davies_bouldin_score,
        silhouette_samples,
        silhouette_score,
        silhouette_scores,
    )

__all__ = [
    "HistogramBins",
    "KMeans",
    "KMeansStep",
    "RGNGStep",
    "RobustGrowingNeuralGas",
    "davies_bouldin_score",
    "silhouette_samples",
    "silhouette_score",
    "silhouette_scores",
]

_MODULES = {
    "HistogramBins": "histogram",
    "KMeans": "kmeans",
    "KMeansStep": "kmeans",
    "RGNGStep": "rgng",
    "RobustGrowingNeuralGas": "rgng",
}


def __getattr__(name: str) -> Any:
    """Import a public name from its module (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES.get(name, 'scores')}"), name)


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
