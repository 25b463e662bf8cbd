"""How faithful a world is: compare it with recorded jumps, from the start pose and from treads.

- :func:`measure_fidelity`. The paper's authors recorded jumps in Gazebo, all from the start pose, and published them. Each is
  replayed. Is the outcome of the same kind? How far apart are the two ends? Are the cubes turned, aside and off the next riser
  as the recorded ones are?
- :func:`measure_tread_fidelity`. An agent that climbs jumps from treads, from poses that earlier jumps left. So rollouts on fifteen
  steps are compared: where the cubes come to rest, and how probable it is that the next jump climbs. A resting cube rocks, which no
  file holds; so these are compared as distributions, not jump by jump.

The gap to the riser ahead decides most: a cube that rests close to a riser is in a trap, since the riser stops its next jump.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation
from scipy.stats import ks_2samp
from tqdm import tqdm

from stairlab._files import read_table
from stairlab._validation import Seed, finite_array, one_of, seed_sequence, whole_number
from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.sampling import Samples
from stairlab.world import FEATURES, MAP_HALF_WIDTH, MAP_MARGIN_Y, CubeWorld, StairWorld, yaw_of

OFF_THE_MAP = "off the map"
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
""" Shown of each distribution """
ASIDE = 0.05
""" A cube is aside if it is farther than this from where it was in x [m] """
TURNED = 5.0
""" A cube is turned if its yaw is larger than this [deg] """
CLOSE = 0.03
""" A cube is close to a riser if the gap is below this; from there no recorded jump climbs [m] """

UNIT = 1e-3
""" A quaternion's length may differ from 1 by this much """

LONGEST_ROLLOUT = 15
""" Jumps """
HIGHEST = 4.4
""" A rollout ends with a cube higher than this: it is on the top tread [m] """
FALLEN = 0.02
""" A cube whose centre is not above this is off the map [m] """
WIDE_MOTIONS = ((50.0, 1.0), (1000.0, 89.0))
STEEP_MOTIONS = ((300.0, 55.0), (700.0, 89.0))
""" The two ranges of motions in rollouts, from and to: magnitude [N] and angle [deg]; a coin decides for each jump """
MotionRange = tuple[tuple[float, float], tuple[float, float]]
""" Lowest and highest magnitude [N] and angle [deg] """
MODERATE_MOTIONS: MotionRange = ((350.0, 55.0), (650.0, 75.0))
""" Motions of which the probability to climb is measured: enough for a step, not enough to fly off """
MOTION_RANGES: dict[str, MotionRange] = {
    "moderate": MODERATE_MOTIONS,
    "strong": ((700.0, 60.0), (1000.0, 78.0)),
    "strong and steep": ((700.0, 78.0), (1000.0, 89.0)),
    "steep": ((50.0, 85.0), (1000.0, 89.0)),
}
""" Motions whose outcomes are compared one by one: agents use few motions, a grid's mostly its strongest and steepest """
GAP_BINS = (0.0, 0.03, 0.06, 0.1, 0.15, 0.2, 0.4)
""" Edges of the bins by gap [m] """
YAW_BINS = (0.0, 0.5, 5.0, 20.0, 45.0)
""" Edges of the bins by yaw [deg] """
TREAD_POSES = tuple(f"{when}_{name}" for when in ("start", "end") for name in FEATURES[:7])
TREAD_COLUMNS = ("rollout", "jump", "magnitude", "angle", *TREAD_POSES)


@dataclass(frozen=True, eq=False)
class Compared:
    """One quantity of recorded cubes, and of a world's own.

    Attributes
    ----------
    recorded, own : ndarray
        Its values, in any order; the two need not be of one length.
    """

    recorded: np.ndarray
    own: np.ndarray

    @property
    def ks(self) -> float:
        """Two-sample Kolmogorov-Smirnov distance, 0 to 1; NaN if one of the two is empty."""
        if not len(self.recorded) or not len(self.own):
            return math.nan
        few = max(len(self.recorded), len(self.own)) < 10  # too few for the p-value's limit, which nobody asks for here
        return float(ks_2samp(self.recorded, self.own, method="exact" if few else "asymp").statistic)

    def quantiles(self) -> pd.DataFrame:
        """Return the quantiles 5, 25, 50, 75 and 95 % (rows) of both (columns "recorded" and "own")."""
        index = pd.Index([f"{100 * q:g} %" for q in QUANTILES], name="quantile")
        return pd.DataFrame({"recorded": _quantiles(self.recorded), "own": _quantiles(self.own)}, index)

    def shares_above(self, limit: float) -> tuple[float, float]:
        """Return the shares of recorded and own values above ``limit``."""
        return _share(self.recorded > limit), _share(self.own > limit)


def _quantiles(values: np.ndarray) -> np.ndarray:
    return np.quantile(values, QUANTILES) if len(values) else np.full(len(QUANTILES), np.nan)


def _share(flags: np.ndarray) -> float:
    return float(np.mean(flags)) if len(flags) else math.nan


def _standard_error(share: float, n: int) -> float:
    """Return sqrt(p (1 - p) / n)."""
    return math.sqrt(share * (1 - share) / n) if n else math.nan


def _json(value: Any) -> Any:
    """Return figures as JSON has them: what is not defined is None."""
    if isinstance(value, Mapping):
        return {name: _json(entry) for name, entry in value.items()}
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        return [_json(entry) for entry in value]
    if isinstance(value, float | np.floating):
        return None if math.isnan(value) else float(value)
    return value


# From the start pose


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
    n_climbing : int
        Number of jumps that climb: the recorded end is on the map, one step up at least.
    agreement_climbing, agreement_climbing_se : float
        The share of the same outcome class among these, and its standard error. NaN if there are none.
    dy_error_median_mm, dy_error_p90_mm : float
        Median and 90th percentile of \\|dy replayed - dy recorded\\| [mm], over the jumps whose class agrees and that end on the
        map: a cube that left the map tumbles on for metres, and where it stops says nothing about the stairs. NaN if there are none.
    gap_ks : float
        Two-sample Kolmogorov-Smirnov distance between the recorded and the replayed distribution of the gap to the next riser, 0 to 1,
        over all jumps that end before one (see ``riser_gaps``); each distribution is of its own jumps. NaN if one of them is empty.
    aside, yaw, gap : Compared
        Where jumps that climb end, recorded and replayed, each of its own jumps: ``|dx|`` [m]; how far the cube's faces are
        turned about the vertical, 0 to 45 [deg]; gap between the foremost corner and the riser ahead, where there is one [m].
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
    n_climbing: int
    agreement_climbing: float
    agreement_climbing_se: float
    aside: Compared = field(repr=False)
    yaw: Compared = field(repr=False)
    gap: Compared = field(repr=False)
    confusion: pd.DataFrame = field(repr=False)
    labels: tuple[str, ...] = field(repr=False)
    recorded: np.ndarray = field(repr=False)
    replayed: np.ndarray = field(repr=False)
    dy_errors: np.ndarray = field(repr=False)
    gaps_recorded: np.ndarray = field(repr=False)
    gaps_replayed: np.ndarray = field(repr=False)

    def summary(self) -> dict[str, Any]:
        """Return the figures by name, as JSON has them.

        These are n, agreement, dy_error_median_mm, dy_error_p90_mm, gap_ks, agreement_se, n_climbing, agreement_climbing,
        agreement_climbing_se; and "climbing", with the quantiles, distance and shares of the jumps that climb. A figure that is not
        defined, because no jump counts for it, is None.
        """
        names = ["n", "agreement", "dy_error_median_mm", "dy_error_p90_mm", "gap_ks", "agreement_se"]
        names += ["n_climbing", "agreement_climbing", "agreement_climbing_se"]
        figures: dict[str, Any] = {name: getattr(self, name) for name in names}
        return _json(figures | {"climbing": self._climbing()})

    def _climbing(self) -> dict[str, Any]:
        figures: dict[str, Any] = {"n_recorded": len(self.aside.recorded), "n_replayed": len(self.aside.own)}
        for name, pair in (("aside_m", self.aside), ("yaw_deg", self.yaw), ("gap_m", self.gap)):
            recorded, replayed = _quantiles(pair.recorded), _quantiles(pair.own)
            figures[name] = {"ks": pair.ks, "recorded": recorded, "replayed": replayed}
        for name, pair, limit in (("share_aside", self.aside, ASIDE), ("share_turned", self.yaw, TURNED)):
            figures[name] = dict(zip(("recorded", "replayed"), pair.shares_above(limit), strict=True))
        return figures


def measure_fidelity(
    samples_or_path: Samples | str | os.PathLike[str],
    world: CubeWorld | None = None,
    seed: Seed = 0,
    *,
    progress: bool = True,
) -> Fidelity:
    """Replay recorded jumps, each from its recorded start state, and compare the outcomes.

    Parameters
    ----------
    samples_or_path : Samples or path-like
        Recorded jumps, or a CSV file with the published columns.
    world : CubeWorld, optional
        Where to replay them; the plane, with four steps, by default. Its state afterwards is what it was before.
    seed : int or numpy.random.SeedSequence
        For a world that is random, such as ``TumblingWorld``: jump i draws from child i of the seed.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Fidelity

    Raises
    ------
    ValueError
        If the file is not a table of jumps, or a jump cannot be replayed: its start lies inside the stairs, or its motion outside
        the motion space; or the quaternion in which a jump ends is not of length 1. The message says which.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> from stairlab.sampling import sample_motions
    >>> own = sample_motions(StairWorld(), n=20, progress=False)
    >>> measure_fidelity(own, progress=False).agreement
    1.0
    """
    world = StairWorld() if world is None else _checked_world(world)
    samples = _samples(samples_or_path, world)
    replay = _replay(samples, world, seed, progress)
    return _compare(samples, replay, world.staircase)


def _checked_world(world: CubeWorld) -> CubeWorld:
    if not isinstance(world, CubeWorld):
        raise TypeError(f"world must be a StairWorld or a TumblingWorld, not {world!r}.")
    return world


@contextmanager
def _left_as_it_was(world: CubeWorld) -> Iterator[None]:
    """Put the world back into its state in the end."""
    before = world.state
    try:
        yield
    finally:
        world.reset(before)


def _samples(samples_or_path: Samples | str | os.PathLike[str], world: CubeWorld) -> Samples:
    if isinstance(samples_or_path, (str, os.PathLike)):
        return Samples.from_csv(samples_or_path, world)
    if not isinstance(samples_or_path, Samples):
        raise TypeError(f"samples_or_path must be Samples or the path of a CSV file, not {samples_or_path!r:.80}.")
    if samples_or_path.feature_names != FEATURES:
        raise ValueError(
            f"samples_or_path must have the features {FEATURES} of the stairs, not {samples_or_path.feature_names}."
        )
    return samples_or_path


def _replay(samples: Samples, world: CubeWorld, seed: Seed, progress: bool) -> Samples:
    children = seed_sequence(seed).spawn(len(samples)) if world.random else [None] * len(samples)
    effects, on_map = np.empty_like(samples.effects), np.empty(len(samples), dtype=bool)
    with _left_as_it_was(world):
        for i in tqdm(range(len(samples)), desc="replay", unit="jump", disable=not progress, leave=False, delay=0.5):
            rng = np.random.default_rng(children[i]) if world.random else None
            try:
                world.reset(samples.starts[i])
                jump = world.perform(samples.motions[i], rng)
            except (ValueError, RuntimeError) as error:
                raise ValueError(f"Jump {i + 1} of {len(samples)} cannot be replayed: {error}") from None
            effects[i], on_map[i] = jump.effect, jump.on_map
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
    climb = recorded.on_map & (steps[0] >= 1)
    climb_share = _share(same[climb])
    ends = [_climbing_ends(*pair, stairs) for pair in zip((recorded, replayed), steps, strict=True)]
    return Fidelity(
        n=len(recorded),
        agreement=share,
        agreement_se=_standard_error(share, len(recorded)),
        dy_error_median_mm=float(median),
        dy_error_p90_mm=float(p90),
        gap_ks=Compared(*gaps).ks,
        n_climbing=int(climb.sum()),
        agreement_climbing=climb_share,
        agreement_climbing_se=_standard_error(climb_share, int(climb.sum())),
        **{name: Compared(*(end[name] for end in ends)) for name in ("aside", "yaw", "gap")},
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


def _climbing_ends(samples: Samples, steps: np.ndarray, stairs: Staircase) -> dict[str, np.ndarray]:
    """Return how far aside [m], how turned [deg] and how far from the riser ahead [m] the jumps that climb end."""
    rows = np.flatnonzero(samples.on_map & (steps >= 1))
    ends = (samples.starts + samples.effects)[rows]
    lengths = np.linalg.norm(ends[:, 3:7], axis=1)
    if (wrong := np.abs(lengths - 1) > UNIT).any():
        row = int(np.argmax(wrong))
        raise ValueError(
            f"Jump {rows[row] + 1} of {len(samples)} must end in a unit quaternion, not {ends[row, 3:7].round(4).tolist()} of "
            f"length {lengths[row]:.4g}."
        )
    gaps = corner_gaps(ends, stairs)
    aside = np.abs(samples.effects[rows, 0])
    return {"aside": aside, "yaw": yaws(ends), "gap": gaps[np.isfinite(gaps)]}


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


# Poses at rest


def levels(states: np.ndarray, stairs: Staircase | None = None) -> np.ndarray:
    r"""Return the number of the tread on which each cube rests, 0 on the ground.

    .. math:: k = \operatorname{round}((z - l / 2) / h)

    with the cube's edge l and the rise h of a step.

    Parameters
    ----------
    states : array-like of shape (n, 7) or (n, 8)
        Positions [m] and unit quaternions x y z w; d_obs, if given, is not used.
    stairs : Staircase, optional
        The stairs; four steps by default.

    Returns
    -------
    ndarray of shape (n,), int
    """
    return np.round((_poses(states)[:, 2] - CUBE_EDGE / 2) / (stairs or Staircase()).rise).astype(int)


def corner_gaps(states: np.ndarray, stairs: Staircase | None = None) -> np.ndarray:
    r"""Gap between the foremost corner of each resting cube and the riser ahead of its tread.

    .. math:: g = y_r - (y + \tfrac{l}{2} \sum_j |R_{yj}|)

    with the riser's y_r, the cube's edge l and the y row of its rotation matrix R. An upright cube reaches l / 2 = 5 cm ahead of its
    centre, and one that is turned by 45 degrees 7.1 cm.

    Parameters
    ----------
    states : array-like of shape (n, 7) or (n, 8)
        Positions [m] and unit quaternions x y z w; d_obs, if given, is not used.
    stairs : Staircase, optional
        The stairs; four steps by default.

    Returns
    -------
    ndarray of shape (n,)
        Gaps [m]; NaN on the last tread, which no riser follows.

    Examples
    --------
    >>> from stairlab.world import StairWorld
    >>> world = StairWorld()
    >>> upright, turned = world.state_at(0.4, 0.05), world.state_at(0.4, 0.05, yaw=0.7853981634)
    >>> corner_gaps([upright, turned]).round(4).tolist()
    [0.15, 0.1293]
    """
    poses, stairs = _poses(states), stairs or Staircase()
    rows = Rotation.from_quat(poses[:, 3:7]).as_matrix()[:, 1, :] if len(poses) else np.empty((0, 3))
    reach = CUBE_EDGE / 2 * np.abs(rows).sum(axis=1)
    tread = levels(poses, stairs)
    gaps = stairs.first_riser + stairs.run * tread - (poses[:, 1] + reach)
    return np.where((tread >= 0) & (tread < stairs.n_steps), gaps, np.nan)


def yaws(states: np.ndarray) -> np.ndarray:
    """Angle by which the faces of each cube are turned about the vertical: the absolute value of ``yaw_of``.

    Parameters
    ----------
    states : array-like of shape (n, 7) or (n, 8)
        Positions [m] and unit quaternions x y z w; d_obs, if given, is not used.

    Returns
    -------
    ndarray of shape (n,)
        Yaws, 0 to 45 [deg].
    """
    poses = _poses(states)
    return np.abs(np.vectorize(yaw_of, otypes=[float])(*poses[:, 3:7].T)) if len(poses) else np.empty(0)


def _poses(states: np.ndarray) -> np.ndarray:
    poses = finite_array("states", states, min_rows=0)
    if poses.shape[1] not in (7, 8):
        raise ValueError(
            f"states must have the columns {', '.join(FEATURES)} (d_obs may be left out), not {poses.shape[1]}."
        )
    return poses[:, :7]


# From treads


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Jumps one after the other, each from where the last one ended.

    Attributes
    ----------
    rollout, jump : ndarray of shape (n_jumps,), int
        Number of the rollout that a jump belongs to, and its place in it from 0 on.
    motions : ndarray of shape (n_jumps, 2)
        Magnitude [N] and angle [deg].
    starts, ends : ndarray of shape (n_jumps, 7)
        Poses at rest before and after: position [m] and unit quaternion x y z w.
    """

    rollout: np.ndarray
    jump: np.ndarray
    motions: np.ndarray
    starts: np.ndarray
    ends: np.ndarray

    def __len__(self) -> int:
        return len(self.jump)

    @classmethod
    def from_csv(cls, path: str | os.PathLike[str]) -> Rollouts:
        """Read a file with the columns rollout, jump, magnitude, angle, and x, y, z, qx, qy, qz, qw after ``start_`` and ``end_``.

        Other columns are ignored.

        Raises
        ------
        ValueError
            If it is not such a file; the message names the file, and the line and column at fault.
        OSError
            If it cannot be read.
        """
        limits = {"rollout": (0.0, 1e9), "jump": (0.0, 1e6), "magnitude": (50.0, 1000.0), "angle": (1.0, 89.0)}
        limits |= {name: (-1.001, 1.001) if "_q" in name else (-1e3, 1e3) for name in TREAD_POSES}
        table = read_table(path)
        values = table.numbers(TREAD_COLUMNS, limits=limits)
        lines = [line for line, _ in table.rows]
        for place, name in enumerate(TREAD_COLUMNS[:2]):
            if (wrong := values[:, place] % 1 != 0).any():
                row = int(np.argmax(wrong))
                found = f"found {values[row, place]:g}"
                raise ValueError(f"{table.name}, line {lines[row]}, column {name}: expected a whole number, {found}.")
        for first, when in ((4, "start"), (11, "end")):
            lengths = np.linalg.norm(values[:, first + 3 : first + 7], axis=1)
            if (wrong := np.abs(lengths - 1) > UNIT).any():
                row = int(np.argmax(wrong))
                raise ValueError(
                    f"{table.name}, line {lines[row]}, columns {when}_qx to {when}_qw: expected a quaternion of length 1, found "
                    f"one of length {lengths[row]:.4g}."
                )
        rollout, jump = values[:, :2].astype(int).T
        return cls(rollout, jump, values[:, 2:4], values[:, 4:11], values[:, 11:18])


def roll_out(world: CubeWorld, rollouts: int = 2000, seed: Seed = 0, *, progress: bool = True) -> Rollouts:
    """Make rollouts of random jumps from the start pose, as those of the recorded file were made.

    For each jump a coin decides between two ranges of motions: the whole motion space, or 300 to 700 N at 55 to 89 degrees, which
    is where jumps climb. A rollout ends when the cube is off the map or on the top tread, or has made 15 jumps.

    Parameters
    ----------
    world : CubeWorld
        Where; its state afterwards is what it was before.
    rollouts : int
        Number of rollouts.
    seed : int or numpy.random.SeedSequence
        Rollout r draws from child r of the seed.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Rollouts

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described.
    RuntimeError
        If a jump is not over within 20 simulated seconds.
    """
    _checked_world(world)
    children = seed_sequence(seed).spawn(whole_number("rollouts", rollouts, low=1))
    rows: list[tuple] = []
    with _left_as_it_was(world):
        for number in tqdm(
            range(rollouts), desc="rollouts", unit="rollout", disable=not progress, leave=False, delay=0.5
        ):
            rows += ((number, *row) for row in _one_rollout(world, np.random.default_rng(children[number])))
    rollout, jump, motions, starts, ends = (np.array(column) for column in zip(*rows, strict=True))
    return Rollouts(rollout, jump, motions, starts[:, :7], ends[:, :7])


def _one_rollout(
    world: CubeWorld, rng: np.random.Generator
) -> Iterator[tuple[int, np.ndarray, np.ndarray, np.ndarray]]:
    world.reset()
    for number in range(LONGEST_ROLLOUT):
        motion = rng.uniform(*(WIDE_MOTIONS if rng.random() < 0.5 else STEEP_MOTIONS))
        jump = world.perform(motion, rng)
        yield number, motion, jump.start, jump.end
        if not _on_map(jump.end[None], world.staircase)[0] or jump.end[2] > HIGHEST:
            return


def jump_again(rollouts: Rollouts, world: CubeWorld, seed: Seed = 0, *, progress: bool = True) -> Rollouts:
    """Make the jumps from treads again, each from its recorded pose, with a draw of its own.

    So a world is asked about the poses and motions of the file, whatever poses its own rollouts lead to. The plane knows neither x nor
    a turn: there the cube is put square to the stairs, at the same gap.

    Parameters
    ----------
    rollouts : Rollouts
        The jumps; those from the start and from the top tread are left out.
    world : CubeWorld
        Where; its state afterwards is what it was before.
    seed : int or numpy.random.SeedSequence
        Jump i draws from child i of the seed.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Rollouts
        With the recorded starts and the new ends.
    """
    stairs = _checked_world(world).staircase
    resting = (rollouts.jump > 0) & (levels(rollouts.starts, stairs) < stairs.n_steps)
    starts, motions = rollouts.starts[resting], rollouts.motions[resting]
    gaps, children = corner_gaps(starts, stairs), seed_sequence(seed).spawn(len(starts))
    ends = np.empty_like(starts)
    with _left_as_it_was(world):
        for i in tqdm(
            range(len(starts)), desc="jumps again", unit="jump", disable=not progress, leave=False, delay=0.5
        ):
            pose = starts[i]
            if isinstance(world, StairWorld):
                y = stairs.next_riser(pose[1]) - max(gaps[i], 0.0) - CUBE_EDGE / 2
                world.reset(world.state_at(y, stairs.height_at(y) + CUBE_EDGE / 2))
            else:
                world.reset(np.append(pose, stairs.d_obs(pose[1])))
            ends[i] = world.perform(motions[i], np.random.default_rng(children[i])).end[:7]
    return Rollouts(rollouts.rollout[resting], rollouts.jump[resting], motions, starts, ends)


def _on_map(poses: np.ndarray, stairs: Staircase) -> np.ndarray:
    """Whether each pose counts: 0 < y < end of the last tread - 0.04 m, ``|x|`` < 2.46 m, and not fallen."""
    x, y, z = poses[:, :3].T
    return (y > 0) & (y < stairs.end - MAP_MARGIN_Y) & (np.abs(x) < MAP_HALF_WIDTH) & (z > FALLEN)


@dataclass(frozen=True, eq=False)
class TreadMeasures:
    """What is measured on rollouts.

    *Resting poses* are those from which all jumps but the first of each rollout start, below the top tread. A jump climbs if it ends
    on the map and on a higher tread. A *moderate* jump is one with 350 to 650 N at 55 to 75 degrees.

    Attributes
    ----------
    n_jumps, n_rollouts : int
        How many there are.
    gaps : ndarray of shape (n_resting_poses,)
        Gap between the foremost corner and the riser ahead [m].
    yaws : ndarray of shape (n_resting_poses,)
        How far the cube's faces are turned about the vertical, 0 to 45 [deg].
    asides : ndarray of shape (n_resting_poses,)
        ``|x|`` [m].
    motions : ndarray of shape (n_resting_poses, 2)
        Of the jump from each pose: magnitude [N] and angle [deg].
    climbed, fell, left : ndarray of shape (n_resting_poses,), bool
        Whether it climbs, ends on the map but lower, or leaves the map.
    freed : ndarray of shape (n_resting_poses,), bool
        Whether it ends on the map, not close to a riser (3 cm or more off it, or on the top tread).
    tops : ndarray of shape (n_rollouts,), int
        Highest step on which a jump of each rollout ended.
    """

    n_jumps: int
    n_rollouts: int
    gaps: np.ndarray = field(repr=False)
    yaws: np.ndarray = field(repr=False)
    asides: np.ndarray = field(repr=False)
    motions: np.ndarray = field(repr=False)
    climbed: np.ndarray = field(repr=False)
    fell: np.ndarray = field(repr=False)
    left: np.ndarray = field(repr=False)
    freed: np.ndarray = field(repr=False)
    tops: np.ndarray = field(repr=False)

    @classmethod
    def of(cls, rollouts: Rollouts, stairs: Staircase | None = None) -> TreadMeasures:
        """Measure rollouts on some stairs, by default those with fifteen steps."""
        stairs = stairs or Staircase.fifteen()
        before, after = levels(rollouts.starts, stairs), levels(rollouts.ends, stairs)
        resting = (rollouts.jump > 0) & (before < stairs.n_steps)
        stays = _on_map(rollouts.ends, stairs)
        climbed, freed = stays & (after > before), stays & ~(corner_gaps(rollouts.ends, stairs) < CLOSE)
        poses = rollouts.starts[resting]
        return cls(
            n_jumps=len(rollouts),
            n_rollouts=len(np.unique(rollouts.rollout)),
            gaps=corner_gaps(poses, stairs),
            yaws=yaws(poses),
            asides=np.abs(poses[:, 0]),
            motions=rollouts.motions[resting],
            climbed=climbed[resting],
            fell=(stays & (after < before))[resting],
            left=~stays[resting],
            freed=freed[resting],
            tops=pd.Series(after).groupby(rollouts.rollout).max().to_numpy(),
        )

    @property
    def moderate(self) -> np.ndarray:
        """Whether the jump from each resting pose is moderate, shape (n_resting_poses,)."""
        return self._within(MODERATE_MOTIONS)

    def _within(self, ranges: MotionRange) -> np.ndarray:
        low, high = np.array(ranges)
        return ((low <= self.motions) & (self.motions <= high)).all(axis=1)

    def outcomes_by_motion(self) -> pd.DataFrame:
        """Return, for each of ``MOTION_RANGES``, the number of jumps (n) and the shares that climb, fall, and leave the map (left)."""
        rows = []
        for ranges in MOTION_RANGES.values():
            made = self._within(ranges)
            shares = {"climb": self.climbed, "fall": self.fell, "left": self.left}
            rows.append({"n": int(made.sum())} | {name: _share(happened[made]) for name, happened in shares.items()})
        return pd.DataFrame(rows, pd.Index(MOTION_RANGES, name="motions"))

    @property
    def climb(self) -> float:
        """Share of the moderate jumps from resting poses that climb; NaN if there are none."""
        return _share(self.climbed[self.moderate])

    @property
    def climb_se(self) -> float:
        """Its standard error, sqrt(p (1 - p) / n)."""
        return _standard_error(self.climb, int(self.moderate.sum()))

    @property
    def climb_all(self) -> float:
        """Share of all jumps from resting poses that climb; NaN if there are none."""
        return _share(self.climbed)

    @property
    def freed_share(self) -> float:
        """Share of the cubes close to a riser, within 3 cm, that one more jump of any kind frees from it; NaN if there are none."""
        return _share(self.freed[self.gaps < CLOSE])

    @property
    def top_quartiles(self) -> tuple[float, float, float]:
        """Quartiles over rollouts of the highest step on which a jump ended."""
        first, median, third = np.quantile(self.tops, (0.25, 0.5, 0.75)).tolist()
        return first, median, third

    def climb_by_gap(self) -> pd.DataFrame:
        """Return number (n) and share (climb) of the moderate jumps that climb, by gap: 0 to 3 cm, ..., 20 to 40 cm.

        A gap below 0, of a cube that overlaps the riser by a hair, counts as 0; gaps of more than 40 cm are left out.
        """
        names = [f"{100 * a:g} to {100 * b:g} cm" for a, b in pairwise(GAP_BINS)]
        return self._climb_by(np.maximum(self.gaps, 0), GAP_BINS, pd.Index(names, name="gap"))

    def climb_by_yaw(self) -> pd.DataFrame:
        """Return number (n) and share (climb) of the moderate jumps that climb, by yaw: 0 to 0.5 degrees, ..., 20 to 45."""
        names = [f"{a:g} to {b:g}°" for a, b in pairwise(YAW_BINS)]
        return self._climb_by(self.yaws, YAW_BINS, pd.Index(names, name="yaw"))

    def _climb_by(self, values: np.ndarray, edges: Sequence[float], names: pd.Index) -> pd.DataFrame:
        """Each bin holds its lower edge and, if it is the last, its upper one too."""
        values, climbed = values[self.moderate], self.climbed[self.moderate]
        n, _ = np.histogram(values, edges)
        up, _ = np.histogram(values[climbed], edges)
        return pd.DataFrame({"n": n, "climb": up / np.where(n, n, np.nan)}, names)

    def summary(self) -> dict[str, Any]:
        """Return the figures by name, as JSON has them; a figure that is not defined is None."""
        figures: dict[str, Any] = {
            "n_jumps": self.n_jumps,
            "n_rollouts": self.n_rollouts,
            "n_resting_poses": len(self.gaps),
            "n_moderate": int(self.moderate.sum()),
            "climb": self.climb,
            "climb_se": self.climb_se,
            "climb_all": self.climb_all,
            "freed_share": self.freed_share,
            "top_quartiles": self.top_quartiles,
            "gap_m": _quantiles(self.gaps),
            "yaw_deg": _quantiles(self.yaws),
            "x_m": _quantiles(self.asides),
            "share_close": _share(self.gaps < CLOSE),
            "share_turned": _share(self.yaws > TURNED),
            "share_aside": _share(self.asides > ASIDE),
            "outcomes_by_motion": self.outcomes_by_motion().reset_index().to_dict("records"),
            "climb_by_gap": self.climb_by_gap().reset_index().to_dict("records"),
            "climb_by_yaw": self.climb_by_yaw().reset_index().to_dict("records"),
        }
        return _json(figures)


@dataclass(frozen=True, eq=False)
class TreadFidelity:
    """How well a world's own rollouts agree with recorded ones.

    Attributes
    ----------
    reference, own : TreadMeasures
        The same measures on both.
    again : TreadMeasures
        The same on the recorded jumps from treads, made again in the world (see ``jump_again``).
    """

    reference: TreadMeasures
    own: TreadMeasures
    again: TreadMeasures

    @property
    def gap(self) -> Compared:
        """Gaps between the foremost corner and the riser ahead [m]."""
        return Compared(self.reference.gaps, self.own.gaps)

    @property
    def yaw(self) -> Compared:
        """How far the cubes are turned about the vertical [deg]."""
        return Compared(self.reference.yaws, self.own.yaws)

    @property
    def x(self) -> Compared:
        """How far aside they rest, ``|x|`` [m]."""
        return Compared(self.reference.asides, self.own.asides)

    @property
    def gap_ks(self) -> float:
        """Kolmogorov-Smirnov distance of the gaps, 0 to 1; NaN if one of the two has no resting pose, as the next two."""
        return self.gap.ks

    @property
    def yaw_ks(self) -> float:
        """Kolmogorov-Smirnov distance of the yaws."""
        return self.yaw.ks

    @property
    def x_ks(self) -> float:
        """Kolmogorov-Smirnov distance of ``|x|``."""
        return self.x.ks

    def summary(self) -> dict[str, Any]:
        """Return gap_ks, yaw_ks, x_ks, the world's own figures by name, and under "reference" those of the file, as JSON has them."""
        distances = _json({name: getattr(self, name) for name in ("gap_ks", "yaw_ks", "x_ks")})
        again = _json({"outcomes_again": self.again.outcomes_by_motion().reset_index().to_dict("records")})
        return distances | self.own.summary() | again | {"reference": self.reference.summary()}


def measure_tread_fidelity(
    path: str | os.PathLike[str],
    world: CubeWorld | None = None,
    rollouts: int = 2000,
    seed: Seed = 0,
    *,
    progress: bool = True,
) -> TreadFidelity:
    """Compare recorded rollouts on fifteen steps with a world's own by the same protocol (see ``roll_out``).

    Parameters
    ----------
    path : path-like
        CSV file of recorded jumps, with the columns that ``Rollouts.from_csv`` names.
    world : CubeWorld, optional
        The world to measure, with the fifteen steps of the learning task; the tumbling world by default.
    rollouts : int
        Number of its own rollouts.
    seed : int or numpy.random.SeedSequence
        Rollout r, and recorded jump i when it is made again, draw from children r and i of the seed.
    progress : bool
        Show a progress bar.

    Returns
    -------
    TreadFidelity

    Raises
    ------
    ValueError
        If the file is not a table of rollouts, or the world has other stairs.
    OSError
        If the file cannot be read.
    """
    whole_number("rollouts", rollouts, low=1)
    seed_sequence(seed)
    if world is None:
        from stairlab.tumbling import TumblingWorld  # with Numba, which the plane does not need

        world = TumblingWorld(Staircase.fifteen())
    stairs = _checked_world(world).staircase
    if stairs != Staircase.fifteen(stairs.restitution):
        raise ValueError(f"world must have the stairs of the recorded rollouts, Staircase.fifteen(), not {stairs}.")
    recorded = Rollouts.from_csv(path)
    own = roll_out(world, rollouts, seed, progress=progress)
    again = jump_again(recorded, world, seed, progress=progress)
    return TreadFidelity(*(TreadMeasures.of(jumps, stairs) for jumps in (recorded, own, again)))


# Side by side


def fidelity_table(fidelities: Mapping[str, Fidelity]) -> pd.DataFrame:
    """Return the figures of several worlds on one file of recorded jumps side by side, as text.

    Parameters
    ----------
    fidelities : mapping of str to Fidelity
        By the names of the worlds.

    Returns
    -------
    pandas.DataFrame
        A row for each figure; the columns are "recorded" and the worlds.
    """
    return _side_by_side("recorded", {name: _start_rows(fidelity) for name, fidelity in fidelities.items()})


def tread_fidelity_table(fidelities: Mapping[str, TreadFidelity]) -> pd.DataFrame:
    """Return the figures of several worlds on one file of recorded rollouts side by side, as text.

    Parameters
    ----------
    fidelities : mapping of str to TreadFidelity
        By the names of the worlds.

    Returns
    -------
    pandas.DataFrame
        A row for each figure; the columns are "reference" and the worlds.
    """
    return _side_by_side("reference", {name: _tread_rows(fidelity) for name, fidelity in fidelities.items()})


def climb_table(fidelities: Mapping[str, TreadFidelity], by: str = "gap") -> pd.DataFrame:
    """Return the probability that a moderate jump climbs, by gap or by yaw, for the file and several worlds side by side, as text.

    Parameters
    ----------
    fidelities : mapping of str to TreadFidelity
        By the names of the worlds.
    by : {"gap", "yaw"}
        Of what.

    Returns
    -------
    pandas.DataFrame
        A row for each bin, with entries such as "0.10 of 134"; the columns are "reference" and the worlds.
    """
    one_of("by", by, ("gap", "yaw"))
    measures = {"reference": next(iter(fidelities.values())).reference}
    measures |= {name: fidelity.own for name, fidelity in fidelities.items()}
    return _shares_of({name: m.climb_by_gap() if by == "gap" else m.climb_by_yaw() for name, m in measures.items()})


def outcome_table(fidelities: Mapping[str, TreadFidelity]) -> pd.DataFrame:
    """Return how the recorded jumps from treads end, for several ranges of motions: recorded, and made again in several worlds.

    Parameters
    ----------
    fidelities : mapping of str to TreadFidelity
        By the names of the worlds.

    Returns
    -------
    pandas.DataFrame
        A row for each of ``MOTION_RANGES``, with entries such as "0.61, 0.06, 0.11 of 98": the shares that climb, fall, and leave the
        map, and the number of jumps.
    """
    tables = {"reference": next(iter(fidelities.values())).reference.outcomes_by_motion()}
    return _shares_of(tables | {name: fidelity.again.outcomes_by_motion() for name, fidelity in fidelities.items()})


def _shares_of(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Write tables with a number "n" and shares side by side: a column for each, with entries such as "0.61, 0.06, 0.11 of 98"."""
    words = {
        name: [f"{', '.join(_figure(share, 2) for share in shares)} of {n:.0f}" for n, *shares in table.to_numpy()]
        for name, table in tables.items()
    }
    return pd.DataFrame(words, next(iter(tables.values())).index)


Row = tuple[str, str, str]
""" What a figure is called, the recorded one, and the world's own """


def _side_by_side(recorded: str, rows: Mapping[str, list[Row]]) -> pd.DataFrame:
    if not rows:
        raise ValueError("fidelities must hold one world at least.")
    some = next(iter(rows.values()))
    columns = {recorded: [row[1] for row in some]} | {name: [row[2] for row in own] for name, own in rows.items()}
    return pd.DataFrame(columns, [row[0] for row in some])


def _start_rows(fidelity: Fidelity) -> list[Row]:
    climbing = _with_error(fidelity.agreement_climbing, fidelity.agreement_climbing_se)
    return [
        ("same outcome class, all jumps [%]", "", _with_error(fidelity.agreement, fidelity.agreement_se)),
        ("same outcome class, jumps that climb [%]", "", climbing),
        ("|dy error|, median [mm]", "", _figure(fidelity.dy_error_median_mm, 2)),
        ("|dy error|, 90 % [mm]", "", _figure(fidelity.dy_error_p90_mm, 1)),
        ("gap to the riser, all jumps: KS distance", "", _figure(fidelity.gap_ks, 3)),
        ("jumps that climb", str(len(fidelity.aside.recorded)), str(len(fidelity.aside.own))),
        *_compared_rows("|dx| [mm]", fidelity.aside, 1000, "more than 5 cm aside", ASIDE),
        *_compared_rows("yaw [deg]", fidelity.yaw, 1, "turned by more than 5 degrees", TURNED),
        *_compared_rows("gap [mm]", fidelity.gap, 1000, "more than 3 cm off the riser", CLOSE),
    ]


def _tread_rows(fidelity: TreadFidelity) -> list[Row]:
    def both(name: str, figure: Callable[[TreadMeasures], str]) -> Row:
        return name, figure(fidelity.reference), figure(fidelity.own)

    moderate = "climbs: 350 to 650 N at 55 to 75 degrees [%]"
    return [
        both("jumps in rollouts", lambda m: f"{m.n_jumps} in {m.n_rollouts}"),
        both("resting poses", lambda m: str(len(m.gaps))),
        *_compared_rows("gap [mm]", fidelity.gap, 1000, "more than 3 cm off the riser", CLOSE),
        *_compared_rows("yaw [deg]", fidelity.yaw, 1, "turned by more than 5 degrees", TURNED),
        *_compared_rows("|x| [mm]", fidelity.x, 1000, "more than 5 cm aside", ASIDE),
        both(moderate, lambda m: _with_error(m.climb, m.climb_se)),
        both("climbs: all jumps from resting poses [%]", lambda m: _figure(100 * m.climb_all, 1)),
        both("within 3 cm of the riser: freed by one more jump [%]", lambda m: _figure(100 * m.freed_share, 1)),
        both("highest step of a rollout, quartiles", lambda m: ", ".join(f"{top:g}" for top in m.top_quartiles)),
    ]


def _compared_rows(name: str, pair: Compared, scale: float, share: str, limit: float) -> list[Row]:
    recorded, own = (" ".join(_figure(scale * q, 1) for q in _quantiles(side)) for side in (pair.recorded, pair.own))
    above = [_figure(100 * value, 1) for value in pair.shares_above(limit)]
    return [
        (f"{name}: 5, 25, 50, 75, 95 %", recorded, own),
        (f"{name.split(' [')[0]}: KS distance", "", _figure(pair.ks, 3)),
        (f"{share} [%]", above[0], above[1]),
    ]


def _with_error(share: float, error: float) -> str:
    return f"{_figure(100 * share, 2)} ± {_figure(100 * error, 2)}"


def _figure(value: float, digits: int) -> str:
    return "-" if math.isnan(value) else f"{round(value, digits) + 0.0:.{digits}f}"  # + 0.0: no "-0.0"
