"""How faithful the world is: replay recorded jumps and compare where they end.

The paper's authors recorded their jumps in Gazebo and published them. Replaying each motion from its recorded start tells three
things: how often the outcome is of the same kind, how far apart the two ends are, and whether the cubes come to rest as far from
the next riser as the recorded ones. The last one matters because a cube that rests flush against a riser is in a trap.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from scipy.stats import ks_2samp
from tqdm import tqdm

from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.sampling import Samples
from stairlab.world import FEATURES, StairWorld

OFF_THE_MAP = "off the map"


@dataclass(frozen=True, eq=False)
class Fidelity:
    """How well replayed jumps agree with recorded ones.

    The outcome class of a jump is "off the map", or the number of steps that it gained.

    Attributes
    ----------
    n : int
        Number of jumps.
    agreement : float
        Share of jumps with the same outcome class, 0 to 1.
    agreement_se : float
        Its standard error, sqrt(p (1 - p) / n).
    dy_error_median_mm, dy_error_p90_mm : float
        Median and 90th percentile of \\|dy replayed - dy recorded\\| [mm], over the jumps whose class agrees and that end on the
        map: a cube that left the map tumbles on for metres, and where it stops says nothing about the stairs. NaN if there are none.
    gap_ks : float
        Two-sample Kolmogorov-Smirnov distance between the recorded and the replayed distribution of the gap to the next riser, 0 to 1;
        each distribution is of its own jumps. NaN if one of them is empty.
    confusion : pandas.DataFrame
        Number of jumps by recorded (rows) and replayed (columns) outcome class.
    labels : tuple of str
        Names of the outcome classes: "off the map", "0 steps", "1 step", ...
    recorded, replayed : ndarray of shape (n,), int
        Outcome class of each jump, as an index into ``labels``.
    dy_errors : ndarray of shape (n_agreeing,)
        dy replayed - dy recorded of the jumps that count for the two figures above [m].
    gaps_recorded, gaps_replayed : ndarray
        Gap between the cube's front and the riser ahead, for the jumps that end on the map and below the last tread [m].
    """

    n: int
    agreement: float
    agreement_se: float
    dy_error_median_mm: float
    dy_error_p90_mm: float
    gap_ks: float
    confusion: pd.DataFrame = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    recorded: np.ndarray = field(repr=False)
    replayed: np.ndarray = field(repr=False)
    dy_errors: np.ndarray = field(repr=False)
    gaps_recorded: np.ndarray = field(repr=False)
    gaps_replayed: np.ndarray = field(repr=False)

    def summary(self) -> dict[str, float | None]:
        """Return the figures under the names n, agreement, dy_error_median_mm, dy_error_p90_mm, gap_ks, as JSON has them.

        A figure that is not defined, because no jump counts for it, is None.
        """
        figures = {
            "agreement": self.agreement,
            "dy_error_median_mm": self.dy_error_median_mm,
            "dy_error_p90_mm": self.dy_error_p90_mm,
            "gap_ks": self.gap_ks,
        }
        return {"n": self.n, **{k: None if math.isnan(v) else float(v) for k, v in figures.items()}}


def measure_fidelity(
    samples_or_path: Samples | str | os.PathLike[str],
    world: StairWorld | None = None,
    *,
    progress: bool = True,
) -> Fidelity:
    """Replay recorded jumps, each from its recorded start state, and compare the outcomes.

    Parameters
    ----------
    samples_or_path : Samples or path-like
        Recorded jumps, or a CSV file with the published columns.
    world : StairWorld, optional
        Where to replay them; four steps by default. Its state afterwards is what it was before. x does not drift.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Fidelity

    Raises
    ------
    ValueError
        If the file is not a table of jumps, or a jump cannot be replayed: its start lies inside the stairs, or its motion outside
        the motion space. The message says which.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> from stairlab.sampling import sample_motions
    >>> own = sample_motions(StairWorld(), n=20, progress=False)
    >>> measure_fidelity(own, progress=False).agreement
    1.0
    """
    if world is not None and not isinstance(world, StairWorld):
        raise TypeError(f"world must be a StairWorld, not {world!r}.")
    world = world or StairWorld()
    samples = _samples(samples_or_path, world)
    replay = _replay(samples, world, progress)
    return _compare(samples, replay, world.staircase)


def _samples(samples_or_path: Samples | str | os.PathLike[str], world: StairWorld) -> Samples:
    if isinstance(samples_or_path, (str, os.PathLike)):
        return Samples.from_csv(samples_or_path, world)
    if not isinstance(samples_or_path, Samples):
        raise TypeError(f"samples_or_path must be Samples or the path of a CSV file, not {samples_or_path!r:.80}.")
    if samples_or_path.feature_names != FEATURES:
        raise ValueError(
            f"samples_or_path must have the features {FEATURES} of the stairs, not {samples_or_path.feature_names}."
        )
    return samples_or_path


def _replay(samples: Samples, world: StairWorld, progress: bool) -> Samples:
    before = world.state
    effects, on_map = np.empty_like(samples.effects), np.empty(len(samples), dtype=bool)
    try:
        for i in tqdm(range(len(samples)), desc="replay", unit="jump", disable=not progress, leave=False, delay=0.5):
            try:
                world.reset(samples.starts[i])
                jump = world.perform(samples.motions[i])
            except (ValueError, RuntimeError) as error:
                raise ValueError(f"Jump {i + 1} of {len(samples)} cannot be replayed: {error}") from None
            effects[i], on_map[i] = jump.effect, jump.on_map
    finally:
        world.reset(before)
    return Samples(samples.motions, samples.starts, effects, on_map)


def _compare(recorded: Samples, replayed: Samples, stairs: Staircase) -> Fidelity:
    steps = [_steps_gained(samples, stairs) for samples in (recorded, replayed)]
    on_map = np.concatenate([recorded.on_map, replayed.on_map])
    seen = np.concatenate(steps)[on_map]
    lowest, highest = min([0, *seen]), max([stairs.n_steps, *seen])
    labels = (OFF_THE_MAP, *(f"{k} step{'s'[: abs(k) != 1]}" for k in range(lowest, highest + 1)))
    first, second = (
        np.where(samples.on_map, gained - lowest + 1, 0)
        for samples, gained in zip((recorded, replayed), steps, strict=True)
    )
    same = first == second
    errors = (replayed.effects[:, 1] - recorded.effects[:, 1])[same & recorded.on_map]
    median, p90 = np.percentile(np.abs(errors) * 1000, [50, 90]) if len(errors) else (np.nan, np.nan)
    gaps = [riser_gaps(samples, stairs) for samples in (recorded, replayed)]
    share = float(same.mean())
    return Fidelity(
        n=len(recorded),
        agreement=share,
        agreement_se=math.sqrt(share * (1 - share) / len(recorded)),
        dy_error_median_mm=float(median),
        dy_error_p90_mm=float(p90),
        gap_ks=float(ks_2samp(*gaps, method="asymp").statistic) if all(map(len, gaps)) else math.nan,
        confusion=_confusion(first, second, labels),
        labels=labels,
        recorded=first,
        replayed=second,
        dy_errors=errors,
        gaps_recorded=gaps[0],
        gaps_replayed=gaps[1],
    )


def _steps_gained(samples: Samples, stairs: Staircase) -> np.ndarray:
    return np.round(samples.effects[:, 2] / stairs.rise).astype(int)


def _confusion(recorded: np.ndarray, replayed: np.ndarray, labels: tuple[str, ...]) -> pd.DataFrame:
    counts = np.zeros((len(labels), len(labels)), dtype=int)
    np.add.at(counts, (recorded, replayed), 1)
    return pd.DataFrame(counts, pd.Index(labels, name="recorded"), pd.Index(labels, name="replayed"))


def riser_gaps(samples: Samples, stairs: Staircase | None = None) -> np.ndarray:
    r"""Gap between the cube's front and the riser ahead where jumps end, on the map and below the last tread.

    .. math:: g = y_r - (y' + l / 2)

    with the y of the riser ahead of the tread that the cube rests on, and the cube's edge l.

    Parameters
    ----------
    samples : Samples
        Jumps on the stairs.
    stairs : Staircase, optional
        The stairs; four steps by default.

    Returns
    -------
    ndarray of shape (n_ends_before_a_riser,)
        Gaps [m].
    """
    stairs = stairs or Staircase()
    y, z = (samples.starts[:, 1:3] + samples.effects[:, 1:3]).T
    tread = np.round((z - CUBE_EDGE / 2) / stairs.rise).astype(int)
    before_riser = samples.on_map & (tread >= 0) & (tread < stairs.n_steps)
    return (stairs.first_riser + stairs.run * tread - y - CUBE_EDGE / 2)[before_riser]
