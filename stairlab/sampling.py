"""Algorithm 1 of the paper, motion sampling: perform motions, note their effects; and the samples as a table and a CSV file."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import joblib
import numpy as np
import pandas as pd
from tqdm import tqdm

from stairlab._files import read_table, write_whole
from stairlab._validation import Seed, finite_array, one_of, read_only, seed_sequence, whole_number
from stairlab.world import FEATURES, CubeWorld, StairWorld, World, check_world

DISTRIBUTIONS = ("uniform", "gaussian", "grid")
CHUNK = 50
""" Jumps that one process makes at a time """

PUBLISHED_STATE = ("env_x", "env_y", "env_z", "env_rot_x", "env_rot_y", "env_rot_z", "env_rot_w")
PUBLISHED_EFFECT = ("dx", "dy", "dz", "d_rot_x", "d_rot_y", "d_rot_z", "d_rot_w")
PUBLISHED_MAP = "robot_in_map"
PUBLISHED_LIMITS = (
    dict.fromkeys(PUBLISHED_STATE[:3], (-1e3, 1e3))
    | dict.fromkeys(PUBLISHED_EFFECT[:3], (-1e3, 1e3))
    | dict.fromkeys(PUBLISHED_STATE[3:], (-1.001, 1.001))
    | dict.fromkeys(PUBLISHED_EFFECT[3:], (-2.002, 2.002))
)
""" No recorded position [m] or quaternion lies outside """
PUBLISHED_COLUMNS = ("magnitude", "angle", *PUBLISHED_STATE, *PUBLISHED_EFFECT, PUBLISHED_MAP)


@dataclass(frozen=True, eq=False)
class Samples:
    """Omega of Algorithm 1: what was done, from where, and what came of it.

    Attributes
    ----------
    motions : ndarray of shape (n_samples, n_motion_parameters)
        For the stairs: magnitude [N] and angle [deg].
    starts : ndarray of shape (n_samples, n_features)
        State before each motion.
    effects : ndarray of shape (n_samples, n_features)
        e = s' - s of each motion (equation 1).
    on_map : ndarray of shape (n_samples,), bool
        Whether the motion's outcome counts.
    feature_names, motion_names : tuple of str
        Names of the columns of states and of motions.

    Raises
    ------
    ValueError
        If the shapes do not fit together, a value is not finite, or there is no sample.

    Examples
    --------
    >>> samples = sample_motions(StairWorld(), n=20, seed=0, progress=False)
    >>> samples.effect("dy", "dz").shape
    (20, 2)
    >>> len(samples[:5]), len(samples.on_the_map()) <= 20
    (5, True)
    """

    motions: np.ndarray
    starts: np.ndarray
    effects: np.ndarray
    on_map: np.ndarray
    feature_names: tuple[str, ...] = FEATURES
    motion_names: tuple[str, ...] = ("magnitude", "angle")

    def __post_init__(self) -> None:
        for name, names in (
            ("motions", self.motion_names),
            ("starts", self.feature_names),
            ("effects", self.feature_names),
        ):
            array = finite_array(name, getattr(self, name), columns=len(names))
            object.__setattr__(self, name, read_only(array))
        flags = np.asarray(self.on_map)
        if flags.ndim != 1 or not np.isin(flags, (0, 1)).all():
            raise ValueError(f"on_map must hold True or False for each sample, not {self.on_map!r:.80}.")
        object.__setattr__(self, "on_map", read_only(flags.astype(bool)))
        lengths = {name: len(getattr(self, name)) for name in ("motions", "starts", "effects", "on_map")}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"motions, starts, effects and on_map must be of one length, not {lengths}.")

    def __repr__(self) -> str:
        return f"Samples({len(self)} of {' and '.join(self.motion_names)}, {int(self.on_map.sum())} on the map)"

    @property
    def effect_names(self) -> tuple[str, ...]:
        """Names of the effect dimensions: "d" and the feature's name."""
        return tuple(f"d{name}" for name in self.feature_names)

    def effect(self, *names: str) -> np.ndarray:
        """Return the named effect dimensions, shape (n_samples, len(names)); all of them without a name.

        Raises
        ------
        ValueError
            If a name is unknown.
        """
        columns = [
            self.effect_names.index(one_of("effect name", name, self.effect_names))
            for name in names or self.effect_names
        ]
        return self.effects[:, columns]

    def __len__(self) -> int:
        return len(self.motions)

    def __getitem__(self, rows: Any) -> Samples:
        """Return the samples of a slice, a mask, or an array of row numbers."""
        rows = np.atleast_1d(np.arange(len(self))[rows])
        return Samples(
            self.motions[rows],
            self.starts[rows],
            self.effects[rows],
            self.on_map[rows],
            self.feature_names,
            self.motion_names,
        )

    def on_the_map(self) -> Samples:
        """Return the samples that ended on the map; only those are clustered.

        Raises
        ------
        ValueError
            If there are none.
        """
        if not self.on_map.any():
            raise ValueError(f"samples must hold some that ended on the map, but none of the {len(self)} did.")
        return self[self.on_map]

    def to_frame(self) -> pd.DataFrame:
        """Return a pandas DataFrame with a column for each motion parameter, start feature (``start_``), effect, and "on_map"."""
        columns = [*self.motion_names, *(f"start_{name}" for name in self.feature_names), *self.effect_names]
        frame = pd.DataFrame(np.hstack([self.motions, self.starts, self.effects]), columns=columns)
        return frame.assign(on_map=self.on_map)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the published columns; the file appears whole or not at all.

        Raises
        ------
        ValueError
            If the samples are not of the stairs: the published columns are.
        """
        if self.feature_names != FEATURES:
            raise ValueError(
                f"samples must have the features {FEATURES} to be written in the published columns, not {self.feature_names}."
            )
        values = np.hstack([self.motions, self.starts[:, :7], self.effects[:, :7]])
        frame = pd.DataFrame(values, columns=list(PUBLISHED_COLUMNS[:-1])).assign(**{PUBLISHED_MAP: self.on_map})
        write_whole(path, lambda file: frame.to_csv(file, lineterminator="\n"))

    @classmethod
    def from_csv(cls, path: str | os.PathLike[str], world: CubeWorld | None = None) -> Samples:
        """Read a file with the published columns; others, such as a row number, are ignored.

        Parameters
        ----------
        path : str or path-like
            The file.
        world : CubeWorld, optional
            The world whose stairs give d_obs, which is not among the published columns; four steps by default.

        Returns
        -------
        Samples

        Raises
        ------
        ValueError
            If the file is not such a table, or a motion lies outside the motion space; the message names the file, and the line
            and column at fault.
        OSError
            If it cannot be read.
        """
        world = world or StairWorld()
        motion_limits = zip(world.motion_names, zip(world.motion_low, world.motion_high, strict=True), strict=True)
        rows = read_table(path).numbers(PUBLISHED_COLUMNS, (PUBLISHED_MAP,), PUBLISHED_LIMITS | dict(motion_limits))
        motions, states, effects = rows[:, :2], rows[:, 2:9], rows[:, 9:16]
        distance = np.frompyfunc(world.staircase.d_obs, 1, 1)
        before, after = (distance(y).astype(float) for y in (states[:, 1], states[:, 1] + effects[:, 1]))
        return cls(
            motions,
            np.column_stack([states, before]),
            np.column_stack([effects, after - before]),
            rows[:, 16] > 0,
        )


def sample_motions(
    world: World,
    n: int = 2000,
    seed: Seed = 0,
    n_jobs: int = 1,
    *,
    distribution: str = "uniform",
    start: str = "fixed",
    integer_angles: bool = False,
    progress: bool = True,
) -> Samples:
    """Sample motions and their effects (Algorithm 1), with exactly ``n`` motions.

    Sample i draws from child i of the seed, so that it is the same for any ``n``, order, or number of processes.

    Parameters
    ----------
    world : World
        Where to perform the motions. It works on a copy; the state of yours stays as it is.
    n : int
        Number of motions N; for a grid a square number (with two motion parameters).
    seed : int or numpy.random.SeedSequence
        Source of all randomness.
    n_jobs : int
        Processes (joblib); -1 for all cores. The samples do not depend on it.
    distribution : {"uniform", "gaussian", "grid"}
        Uniform over the motion space (the paper); Gaussian about its middle with a sixth of its width as standard deviation, drawn
        again where outside; or a regular grid, corners included.
    start : {"fixed", "drawn"}
        Every motion from the start pose (the paper), or each from a pose that the world draws.
    integer_angles : bool
        Round the motion parameter named "angle", as in the published samples.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Samples

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described.
    """
    check_world(world)
    n = whole_number("n", n, low=1)
    one_of("start", start, ("fixed", "drawn"))
    one_of("distribution", distribution, DISTRIBUTIONS)
    given = _grid_of(world, n) if distribution == "grid" else [None] * n
    return _perform_all(world, given, seed, n_jobs, progress, distribution, start, integer_angles)


def replay_motions(
    world: World, motions: np.ndarray, seed: Seed = 0, n_jobs: int = 1, *, progress: bool = False
) -> Samples:
    """Perform given motions, each from the start pose.

    Parameters
    ----------
    world : World
        Where to perform them. It works on a copy; the state of yours stays as it is.
    motions : array-like of shape (n_motions, n_motion_parameters)
        For the stairs: magnitude [N] and angle [deg].
    seed : int or numpy.random.SeedSequence
        For worlds with randomness of their own.
    n_jobs : int
        Processes (joblib); -1 for all cores.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Samples

    Raises
    ------
    ValueError
        If the motions have another shape, or one lies outside the motion space.
    """
    check_world(world)
    motions = finite_array("motions", motions, columns=len(world.motion_names))
    outside = ((motions < world.motion_low) | (motions > world.motion_high)).any(axis=1)
    if outside.any():
        row = int(np.argmax(outside))
        values = ", ".join(f"{name} {value:g}" for name, value in zip(world.motion_names, motions[row], strict=True))
        raise ValueError(
            f"motions must lie between {np.asarray(world.motion_low).tolist()} and {np.asarray(world.motion_high).tolist()}, "
            f"but row {row + 1} is {values}."
        )
    return _perform_all(world, motions, seed, n_jobs, progress)


def noisy_motions(world: World, motions: np.ndarray, rng: np.random.Generator, scale: float = 1.0) -> np.ndarray:
    """Return motions as they come out where actuators are noisy, clipped to the motion space.

    Parameters
    ----------
    world : World
        Says how large the noise is, see ``noise_scale`` (for the stairs 2 % of the magnitude and 1 degree).
    motions : ndarray of shape (n_motions, n_motion_parameters)
        The motions that were meant, for the stairs magnitude [N] and angle [deg]; for several tries of one, several equal rows.
    rng : numpy.random.Generator
        Draws the noise, which is Gaussian.
    scale : float
        Times as large as the world says.

    Returns
    -------
    ndarray of shape (n_motions, n_motion_parameters)
        The motions that come out, in the same units.
    """
    noise = np.array([world.noise_scale(motion) for motion in motions]) * rng.standard_normal(np.shape(motions))
    return np.clip(motions + scale * noise, world.motion_low, world.motion_high)


def _perform_all(
    world: World, given: Sequence | np.ndarray, seed: Seed, n_jobs: int, progress: bool, *how: Any
) -> Samples:
    if (n_jobs := whole_number("n_jobs", n_jobs, low=-64)) == 0:
        raise ValueError("n_jobs must be a number of processes, or -1 for all cores, not 0.")
    tasks = list(zip(seed_sequence(seed).spawn(len(given)), given, strict=True))
    chunks = [tasks[i : i + CHUNK] for i in range(0, len(tasks), CHUNK)]
    world = copy.deepcopy(world)  # the caller's stays as it is
    work = (joblib.delayed(_perform)(world, chunk, *how) for chunk in chunks)
    outcomes = _gather(joblib.Parallel(n_jobs=n_jobs, return_as="generator")(work), len(tasks), progress)
    motions, starts, ends, on_map = (np.array(column) for column in zip(*outcomes, strict=True))
    return Samples(motions, starts, ends - starts, on_map, tuple(world.feature_names), tuple(world.motion_names))


def _grid_of(world: World, n: int) -> np.ndarray:
    parameters = len(world.motion_names)
    per_side = round(n ** (1 / parameters))
    if per_side**parameters != n:
        raise ValueError(
            f"n must be a whole number to the power of {parameters} for a grid over {parameters} motion parameters, "
            f"such as {per_side**parameters}, not {n}."
        )
    return motion_grid(world, per_side)


def _gather(chunks: Iterable[list], n: int, progress: bool) -> list:
    with tqdm(total=n, desc="jumps", unit="jump", disable=not progress, leave=False, delay=0.5) as bar:
        outcomes: list = []
        for chunk in chunks:
            outcomes += chunk
            bar.update(len(chunk))
    return outcomes


def _perform(
    world: World, tasks: list, distribution: str = "uniform", start: str = "fixed", integer_angles: bool = False
) -> list[tuple]:
    outcomes = []
    for child, motion in tasks:
        rng = np.random.default_rng(child)
        if motion is None:
            motion = draw_motion(world, rng, distribution)
        if integer_angles and "angle" in world.motion_names:
            place = world.motion_names.index("angle")
            motion[place] = np.round(motion[place])
        world.reset(world.draw_start(rng) if start == "drawn" else None)
        outcome = world.perform(motion, rng)
        outcomes.append((motion, outcome.start, outcome.end, outcome.on_map))
    return outcomes


def draw_motion(world: World, rng: np.random.Generator, distribution: str = "uniform") -> np.ndarray:
    """Draw a motion from the world's motion space, uniform or Gaussian; shape (n_motion_parameters,)."""
    low, high = np.asarray(world.motion_low), np.asarray(world.motion_high)
    if distribution == "uniform":
        return rng.uniform(low, high)
    while True:
        motion = rng.normal((low + high) / 2, (high - low) / 6)
        if np.all((low <= motion) & (motion <= high)):
            return motion


def motion_grid(world: World, per_side: int) -> np.ndarray:
    """Return a regular grid over the motion space, corners included; shape (per_side ** n_motion_parameters, n_motion_parameters)."""
    sides = [np.linspace(low, high, per_side) for low, high in zip(world.motion_low, world.motion_high, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(sides))
