"""What the estimators of this folder share: their random generator and the check of their samples."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.utils.validation import validate_data

from stairlab._validation import Seed, seed_sequence

LARGEST = 1e100
"""Largest value that the estimators accept: squared distances stay far from overflow."""
SMALLEST = 1e-100
"""Smallest span of values that they accept: squared distances stay far from underflow."""


def random_generator(random_state: Seed | np.random.RandomState | None) -> np.random.Generator:
    """Return a private generator; an int or a ``SeedSequence`` always gives the same one.

    ``None`` (fresh randomness) and ``RandomState`` are accepted as scikit-learn's conventions ask for it.
    """
    if random_state is None:
        return np.random.default_rng()
    if isinstance(random_state, np.random.RandomState):
        return np.random.default_rng(random_state.randint(2**31, size=4))
    return np.random.default_rng(seed_sequence(random_state, name="random_state"))


def training_samples(estimator: Any, X: Any) -> np.ndarray:
    """Return ``X`` as finite floats of shape (n_samples, n_features), at least two samples, not all equal."""
    X = validate_data(estimator, X, dtype=np.float64, ensure_min_samples=2)
    if np.array_equal(X.min(axis=0), X.max(axis=0)):
        raise ValueError(f"X must have at least 2 distinct samples, but all {len(X)} samples equal {X[0]}.")
    largest = np.abs(X).max()
    if largest > LARGEST:
        raise ValueError(f"X must have values of at most {LARGEST:g}, not {largest:g}: use another unit.")
    span = np.ptp(X, axis=0).max()
    if span < SMALLEST:
        raise ValueError(f"X must span at least {SMALLEST:g} in a feature, not {span:g}: use another unit.")
    return X


def count_distinct(X: np.ndarray) -> int:
    """Return the number of distinct rows of ``X``."""
    return len(np.unique(X, axis=0))
