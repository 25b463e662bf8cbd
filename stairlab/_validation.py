"""Input checks that every module shares: each error names the argument, what came, and what was expected."""

from __future__ import annotations

import numbers
import zlib
from collections.abc import Iterable
from typing import Any

import numpy as np

Seed = int | np.random.SeedSequence


def finite_number(
    name: str, value: Any, *, above: float = -np.inf, low: float = -np.inf, high: float = np.inf
) -> float:
    """Return ``value`` as a float if it is finite, greater than ``above`` and within ``[low, high]``."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} must be a number, not {value!r}.")
    number = float(value)
    if not np.isfinite(number):
        raise ValueError(f"{name} must be finite, not {number}.")
    if number <= above:
        raise ValueError(f"{name} must be greater than {above:g}, not {number:g}.")
    if not low <= number <= high:
        raise ValueError(f"{name} must be {_range(low, high)}, not {number:g}.")
    return number


def whole_number(name: str, value: Any, *, low: float = -np.inf, high: float = np.inf) -> int:
    """Return ``value`` as an int if it is a whole number within ``[low, high]``."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise TypeError(f"{name} must be a whole number, not {value!r}.")
    if not low <= (number := int(value)) <= high:
        raise ValueError(f"{name} must be {_range(low, high)}, not {number}.")
    return number


def _range(low: float, high: float) -> str:
    if np.isinf(high):
        return f"at least {low:g}"
    if np.isinf(low):
        return f"at most {high:g}"
    return f"between {low:g} and {high:g}"


def one_of(name: str, value: Any, choices: Iterable[str]) -> str:
    """Return ``value`` if it is one of ``choices``."""
    choices = list(choices)
    if not isinstance(value, str) or value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}, not {value!r}.")
    return value


def finite_array(name: str, value: Any, *, columns: int | None = None, ndim: int = 2, min_rows: int = 1) -> np.ndarray:
    """Return ``value`` as a finite float array of ``ndim`` dimensions, ``min_rows`` rows at least."""
    expected = f"(n, {columns})" if columns else {1: "(n,)", 2: "(n, m)"}[ndim]
    try:
        array = np.asarray(value)
        if array.dtype.kind in "USc":  # neither text nor complex numbers
            raise TypeError
        array = array.astype(float)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be an array of numbers of shape {expected}, not {value!r:.80}.") from None
    if array.ndim != ndim or (columns is not None and array.shape[1] != columns):
        raise ValueError(f"{name} must have the shape {expected}, not {array.shape}.")
    if len(array) < min_rows:
        raise ValueError(f"{name} must have at least {min_rows} row{'s'[: min_rows != 1]}, not {len(array)}.")
    if not np.isfinite(array).all():
        row = int(np.argwhere(~np.isfinite(array))[0][0])
        raise ValueError(f"{name} must be finite, but row {row} holds {array[row]}.")
    return array


def seed_sequence(seed: Seed, purpose: str = "", name: str = "seed") -> np.random.SeedSequence:
    """Return ``seed`` as a fresh ``SeedSequence``, so that using it leaves the caller's own untouched.

    Each purpose has a stream of its own: one seed can be given to every function of a pipeline, and their draws are independent.
    """
    if not isinstance(seed, np.random.SeedSequence):
        seed = np.random.SeedSequence(whole_number(name, seed, low=0))
    key = (*seed.spawn_key, zlib.crc32(purpose.encode())) if purpose else seed.spawn_key
    return np.random.SeedSequence(seed.entropy, spawn_key=key, pool_size=seed.pool_size)


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a copy that nobody can change: what was checked stays right."""
    array = array.copy()
    array.setflags(write=False)
    return array
