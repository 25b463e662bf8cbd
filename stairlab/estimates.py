"""Figures over seeds, and how sure they make us: statistics, and their intervals.

The interquartile mean and intervals over seeds follow the advice of Agarwal et al., "Deep Reinforcement Learning at the Edge of the
Statistical Precipice" (2021); the bootstrap is SciPy's. A statistic is a function of one or more samples and the ``axis`` of the
seeds, which is their last: scores have the shape (n_seeds,), curves (n_steps, n_seeds).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import bootstrap, mannwhitneyu, trim_mean

CONFIDENCE = 0.95
""" Of every interval """
RESAMPLES = 9999
""" Resamples of the seeds behind an interval """
FEWEST_SEEDS = 6
""" With fewer seeds than this there are means and curves, but no interval """

Statistic = Callable[..., np.ndarray]


class Estimate(NamedTuple):
    """A figure over seeds with its 95 % bootstrap interval; the interval is NaN with five seeds or fewer."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        if np.isnan(self.value):
            return "–"  # the spread of a single seed
        interval = "" if np.isnan(self.low) else f" [{self.low:.1f}, {self.high:.1f}]"
        return f"{self.value:.1f}{interval}"


def estimate(statistic: Statistic, *samples: np.ndarray) -> Estimate:
    """Return a statistic that is one number, with its interval."""
    low, high = interval(statistic, *samples)
    return Estimate(float(statistic(*samples, axis=-1)), float(low), float(high))


def interval(statistic: Statistic, *samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the percentile bootstrap interval over seeds, NaN with too few of them."""
    if min(sample.shape[-1] for sample in samples) < FEWEST_SEEDS:
        nan = np.full(np.shape(statistic(*samples, axis=-1)), np.nan)
        return nan, nan
    return _resampled(statistic, *samples).confidence_interval


def p_value(statistic: Statistic, *samples: np.ndarray, bound: float = 0.0) -> float:
    """Return the two-sided p-value of the claim that a statistic is ``bound``: what its bootstrap interval says at all levels at once.

    It is twice the smaller share of the resamples on either side of the bound; below 0.05, the 95 % interval excludes it. NaN with
    too few seeds.
    """
    if min(sample.shape[-1] for sample in samples) < FEWEST_SEEDS:
        return np.nan
    found = _resampled(statistic, *samples).bootstrap_distribution
    side = min((found <= bound).sum(), (found >= bound).sum())
    return min(1.0, 2 * (side + 1) / (RESAMPLES + 1))


def holm(p_values: np.ndarray) -> np.ndarray:
    r"""Return p-values that allow for their number (Holm 1979); NaN stays NaN.

    .. math:: \tilde p_{(i)} = \max_{j \le i} \min(1, (m - j + 1) \, p_{(j)})
    """
    adjusted = np.full(len(p_values), np.nan)
    order = np.argsort(p_values)[: np.isfinite(p_values).sum()]
    scaled = (len(order) - np.arange(len(order))) * p_values[order]
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(scaled)) if len(order) else scaled
    return adjusted


def _resampled(statistic: Statistic, *samples: np.ndarray) -> Any:
    return bootstrap(
        samples,
        statistic,
        n_resamples=RESAMPLES,
        batch=1000,
        axis=-1,
        vectorized=True,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(0),
    )


def iqm(values: np.ndarray, axis: int = -1) -> np.ndarray:
    """Return the interquartile mean: of the middle half of the values."""
    return trim_mean(values, 0.25, axis=axis)


def deviation(values: np.ndarray, axis: int = -1) -> np.ndarray:
    """Return the standard deviation (ddof = 1), NaN for a single seed."""
    return values.std(axis=axis, ddof=1) if values.shape[axis] > 1 else np.full_like(values.sum(axis=axis), np.nan)


def improvement(x: np.ndarray, y: np.ndarray, axis: int = -1) -> np.ndarray:
    r"""Return the probability that a value of the first sample is higher than one of the second, ties counted half.

    .. math:: P(X > Y) = \frac{U}{n_x n_y}

    with the statistic U of Mann and Whitney.
    """
    u = mannwhitneyu(x, y, axis=axis, method="asymptotic").statistic
    return u / (x.shape[axis] * y.shape[axis])


def peak(curves: np.ndarray, axis: int = -1) -> np.ndarray:
    """Return the highest value of the mean of curves."""
    return curves.mean(axis=axis).max(axis=0)


def half_step(steps: np.ndarray) -> Statistic:
    """Return the statistic of curves: the step, one of ``steps``, at which their mean has risen half way.

    It is the last step for a mean that never rises.
    """

    def statistic(curves: np.ndarray, axis: int = -1) -> np.ndarray:
        mean = curves.mean(axis=axis)
        first, highest = mean[0], mean.max(axis=0)
        reached = (mean >= (first + highest) / 2) & (highest > first)
        reached[-1] = True
        return steps[reached.argmax(axis=0)].astype(float)  # SciPy takes no quantiles of whole numbers

    return statistic


def difference_of(statistic: Statistic) -> Statistic:
    """Return the statistic of two samples: by how much a statistic of the first is above that of the second."""

    def difference(x: np.ndarray, y: np.ndarray, axis: int = -1) -> np.ndarray:
        return statistic(x, axis=axis) - statistic(y, axis=axis)

    return difference
