"""What a study found: its tables, and how sure they make us (section 4 of the paper, figure 4).

The interquartile mean and intervals over seeds follow the advice of Agarwal et al., "Deep Reinforcement Learning at the Edge of the
Statistical Precipice" (2021); the bootstrap is SciPy's.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import bootstrap, mannwhitneyu, trim_mean

from stairlab._files import write_bytes, write_whole
from stairlab._validation import one_of
from stairlab.beyond import TUNED_DQN
from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.planning import DEAD_BAND, trap_width
from stairlab.world import StairWorld

TABLES = ("runs", "evaluations", "motions", "episodes")
STUDY_FILE = "study.json"
CONFIDENCE = 0.95
""" Of every interval """
RESAMPLES = 9999
""" Resamples of the seeds behind an interval """
FEWEST_SEEDS = 6
""" With fewer seeds than this there are means and curves, but no interval """
SCORED_EVALUATIONS = 5
""" A run's score is the mean of this many last evaluations """
TOP_STEP = 15
""" Steps of the learning task """
ENDS = ("top", "stuck", "other")
""" How a greedy episode ends: on the top; stuck where its last jumps change nothing; or else (time's up, or off the map) """
STUCK_JUMPS = 5
STUCK_SHIFT = 0.001
""" So many last jumps that all move the cube by less than this are called stuck [m] """
SAME_RETURN = 0.05
""" Returns as near as this are the same: a resting cube can lean, some hundredths of a step """


class Estimate(NamedTuple):
    """A figure over seeds with its 95 % bootstrap interval; the interval is NaN with five seeds or fewer."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        interval = "" if np.isnan(self.low) else f" [{self.low:.1f}, {self.high:.1f}]"
        return f"{self.value:.1f}{interval}"

    @property
    def excludes_zero(self) -> bool:
        """Whether the interval lies on one side of 0."""
        return self.low > 0 or self.high < 0


@dataclass(frozen=True, eq=False)
class StudyResults:
    """The runs of a study as tables; each has the columns "method" and "seed". Made by ``Study.run`` or ``load_published_study``.

    Attributes
    ----------
    runs : pandas.DataFrame
        A row for each run: "score" (mean greedy return of the last five evaluations), number of "actions" and "samples", "seconds"
        of its parts, parameters, and what the search for the best return found: "best_return", a lower bound by the jumps that
        reach it; its upper "bound", whether the two meet ("proved"), and the jumps "simulated".
    evaluations : pandas.DataFrame
        A row for each greedy episode: "step", "episode", "return", "length", "climbed".
    motions : pandas.DataFrame
        A row for each action: "magnitude" [N], "angle" [deg], "class".
    episodes : pandas.DataFrame
        A row for each jump of a trained agent's greedy episode: "jump", "magnitude", "angle", "y", "z" [m], "steps", "reward".
    description : dict
        The study's "settings", its own sets ("own"), and the packages' "versions".
    """

    runs: pd.DataFrame
    evaluations: pd.DataFrame = field(repr=False)
    motions: pd.DataFrame = field(repr=False)
    episodes: pd.DataFrame = field(repr=False)
    description: dict[str, Any] = field(repr=False)

    @classmethod
    def from_runs(cls, folders: Sequence[Path], description: Mapping[str, Any]) -> StudyResults:
        """Read the folders of finished runs.

        Raises
        ------
        ValueError
            If there is none.
        """
        if not folders:
            raise ValueError("There must be a finished run to read, but there is none; run the study first.")
        records = [json.loads((folder / "run.json").read_bytes()) for folder in folders]
        tables = {
            name: _gathered(folders, records, file)
            for name, file in (("evaluations", "evaluations"), ("motions", "motions"), ("episodes", "episode"))
        }
        versions = {name: sorted({record["versions"][name] for record in records}) for name in records[0]["versions"]}
        return cls(
            runs=pd.DataFrame([_row(record) for record in records]),
            description={**description, "versions": {name: ", ".join(found) for name, found in versions.items()}},
            **tables,
        )

    @property
    def methods(self) -> list[str]:
        """The methods, in the order of the study."""
        return list(dict.fromkeys(self.runs["method"]))

    @property
    def quick(self) -> bool:
        """Whether the budgets were too small for the numbers to say anything."""
        return bool(self.description["settings"].get("quick"))

    def scores(self, method: str) -> np.ndarray:
        """Return the score of each seed of a method, shape (n_seeds,)."""
        return self._of("runs", method).sort_values("seed")["score"].to_numpy(dtype=float)

    def curves(self, method: str) -> pd.DataFrame:
        """Return the greedy return of each evaluation of a method: a row for each step, a column for each seed."""
        table = self._of("evaluations", method)
        return table.pivot_table(index="step", columns="seed", values="return", aggfunc="mean")

    def shift(self, method: str) -> int:
        """Return the samples that a method's set was made from: its curve begins so many steps later."""
        return int(self._of("runs", method)["samples"].max())

    def _of(self, table: str, method: str) -> pd.DataFrame:
        one_of("method", method, self.methods)
        rows = getattr(self, table)
        return rows[rows["method"] == method]

    def iqm_curve(self, method: str) -> pd.DataFrame:
        """Return the interquartile mean over seeds at each step ("iqm"), with its 95 % bootstrap interval ("low", "high")."""
        curves = self.curves(method)
        values = curves.to_numpy()
        low, high = _interval(iqm, values)
        return pd.DataFrame(
            {"iqm": iqm(values, axis=0 if values.ndim == 1 else 1), "low": low, "high": high}, index=curves.index
        )

    def score(self, method: str) -> Estimate:
        """Estimate the interquartile mean of a method's scores."""
        return _estimate(iqm, self.scores(method))

    def difference(self, method: str, other: str) -> Estimate:
        """Estimate by how much the mean score of a method is above another's."""
        return _estimate(_mean_difference, self.scores(method), self.scores(other))

    def probability_of_improvement(self, method: str, other: str) -> Estimate:
        r"""Estimate the probability that a run of a method scores higher than one of another, ties counted half.

        .. math:: P(X > Y) = \frac{U}{n_x n_y}

        with the statistic U of Mann and Whitney.
        """
        return _estimate(_improvement, self.scores(method), self.scores(other))

    def steps_to_half(self, method: str) -> Estimate:
        """Estimate the steps until a method's mean curve has reached half of its own highest value, with the samples of its set."""
        curves = self.curves(method)
        return _estimate(_half_step(curves.index.to_numpy() + self.shift(method)), curves.to_numpy())

    def half_step_difference(self, method: str, other: str) -> Estimate:
        """Estimate how many steps later than another a method's mean curve reaches half of its own highest value."""
        mine, theirs = self.curves(method), self.curves(other)
        first = _half_step(mine.index.to_numpy() + self.shift(method))
        second = _half_step(theirs.index.to_numpy() + self.shift(other))
        return _estimate(
            lambda x, y, axis=-1: first(x, axis=axis) - second(y, axis=axis), mine.to_numpy(), theirs.to_numpy()
        )

    def spread(self, method: str) -> Estimate:
        """Estimate the standard deviation of a method's scores over seeds."""
        return _estimate(_deviation, self.scores(method))

    def spread_difference(self, method: str, other: str) -> Estimate:
        """Estimate by how much the standard deviation of a method's scores is above another's."""
        return _estimate(
            lambda x, y, axis=-1: _deviation(x, axis=axis) - _deviation(y, axis=axis),
            self.scores(method),
            self.scores(other),
        )

    def summary(self) -> pd.DataFrame:
        """Return a row for each method.

        Returns
        -------
        pandas.DataFrame
            "method"; number of "seeds" and, on average, of "actions"; the scores' "mean" and "sd", and their interquartile mean "iqm"
            with its 95 % interval "low" to "high" (NaN with five seeds or fewer); "at the top", the share of runs whose last
            greedy episode ends there; "half at", the steps to half of the highest mean, with the samples of the set; "best return",
            what the search says that the sets allow, on average; "allow 15", the share of sets that allow a return of 15; and
            "proved", the share of sets for which nothing better is possible.
        """
        return pd.DataFrame([self._summary(method) for method in self.methods])

    def _summary(self, method: str) -> dict[str, Any]:
        runs, scores = self._of("runs", method), self.scores(method)
        value, low, high = self.score(method)
        last = self._of("evaluations", method).groupby("seed").last()
        searched = runs["best_return"].notna().all()
        return {
            "method": method,
            "seeds": len(runs),
            "actions": runs["actions"].mean(),
            "mean": scores.mean(),
            "sd": scores.std(ddof=1) if len(scores) > 1 else np.nan,
            "iqm": value,
            "low": low,
            "high": high,
            "at the top": (last["climbed"] >= TOP_STEP).mean(),
            "half at": self.steps_to_half(method).value,
            "best return": runs["best_return"].mean(),
            "allow 15": (runs["best_return"] > TOP_STEP - SAME_RETURN).mean() if searched else np.nan,
            "proved": runs["proved"].astype(float).mean() if searched else np.nan,
        }

    def ends(self) -> pd.DataFrame:
        """Say how the greedy episode of each trained agent ends.

        Returns
        -------
        pandas.DataFrame
            A row for each run: "method", "seed", "step" of the stairs on which it ends, the distance "to riser" ahead of the cube's
            front [m], and "end", one of ``ENDS``.
        """
        return pd.DataFrame(
            [
                {"method": method, "seed": seed, **_end(episode)}
                for (method, seed), episode in self.episodes.groupby(["method", "seed"], sort=False)
            ]
        )

    def ways_out(self) -> pd.DataFrame:
        """Ask where each set's trained agent got stuck what the other motions of the set would have done there.

        The agent's jumps are made again, so that the cube stands exactly where it did.

        Returns
        -------
        pandas.DataFrame
            A row for each stuck run with a set of motions: "method", "seed", the number of "motions", how many of them "climb" from
            there, and how many move the cube by more than a millimetre ("move").
        """
        rows = []
        ends = self.ends().set_index(["method", "seed"])["end"]
        sets = dict(iter(self.motions.groupby(["method", "seed"])))
        staircase = Staircase.fifteen(self.description["settings"]["restitution"])
        for key, episode in self.episodes.groupby(["method", "seed"], sort=False):
            if ends[key] == "stuck" and key in sets:
                motions = sets[key][["magnitude", "angle"]].to_numpy()
                world = _replayed(staircase, episode[["magnitude", "angle"]].to_numpy())
                effects = np.array([_effect(world, motion) for motion in motions])
                climb, move = effects[:, 1] > DEAD_BAND, np.abs(effects).sum(axis=1) > STUCK_SHIFT
                rows.append((*key, len(motions), int(climb.sum()), int(move.sum())))
        return pd.DataFrame(rows, columns=["method", "seed", "motions", "climb", "move"])

    def traps(self) -> pd.DataFrame:
        """Measure for each set the trap that a riser is: the gap below which none of its motions climbs (see ``trap_width``).

        Returns
        -------
        pandas.DataFrame
            A row for each run with a set of motions: "method", "seed", the "trap" [m], the "steepest" angle of the set [deg], and the
            run's "score".
        """
        staircase = Staircase.fifteen(self.description["settings"]["restitution"])
        width_of: dict[bytes, float] = {}  # uniform sets are the same for every seed
        rows = []
        for (method, seed), one in self.motions.groupby(["method", "seed"], sort=False):
            motions = one[["magnitude", "angle"]].to_numpy(dtype=float)
            key = motions.tobytes()
            if key not in width_of:
                width_of[key] = trap_width(staircase, motions)
            rows.append((method, seed, width_of[key], motions[:, 1].max()))
        table = pd.DataFrame(rows, columns=["method", "seed", "trap", "steepest"])
        return table.merge(self.runs[["method", "seed", "score"]], on=["method", "seed"])

    def command(self) -> str:
        """Return the command that makes this study."""
        settings = self.description["settings"]
        words = (
            ["stairlab study", "--quick"]
            if self.quick
            else ["stairlab study", f"--timesteps {settings['total_timesteps']}"]
        )
        if settings["dqn"] == TUNED_DQN:
            words.append("--tuned")
        if settings["restitution"] is not None:
            words.append(f"--restitution {settings['restitution']:g}")
        own = self.description["own"]
        words.append("--methods " + " ".join(f"{name}={name}.csv" if name in own else name for name in self.methods))
        seeds = sorted(set(self.runs["seed"]))
        whole = seeds == list(range(seeds[0], seeds[-1] + 1)) and len(seeds) > 1
        return " ".join([*words, "--seeds", f"{seeds[0]}-{seeds[-1]}" if whole else " ".join(map(str, seeds))])

    def save(self, out_dir: str | PathLike[str], *, progress: bool = True) -> list[Path]:
        """Write tables (CSV), figures (PNG) and a report (HTML) into a folder; each file appears whole or not at all.

        Returns
        -------
        list of Path
            The files written.
        """
        from stairlab.study_report import save_study

        return save_study(self, out_dir, progress=progress)

    def save_tables(self, folder: str | PathLike[str]) -> list[Path]:
        """Write the tables and the description, for ``StudyResults.load``."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        for name in TABLES:
            write = partial(getattr(self, name).to_csv, index=False, lineterminator="\n")
            write_whole(folder / f"{name}.csv", write)
        write_bytes(folder / "description.json", (json.dumps(self.description, indent=1) + "\n").encode())
        return [folder / f"{name}.csv" for name in TABLES] + [folder / "description.json"]

    @classmethod
    def load(cls, folder: str | PathLike[str]) -> StudyResults:
        """Read what ``save_tables`` has written.

        Raises
        ------
        OSError
            If a file cannot be read.
        """
        folder = Path(folder)
        tables = {name: pd.read_csv(folder / f"{name}.csv") for name in TABLES}
        return cls(description=json.loads((folder / "description.json").read_bytes()), **tables)


def load_published_study(part: str = "paper") -> StudyResults:
    """Load the study that comes with the package.

    Parameters
    ----------
    part : str
        "paper": the comparison at the paper's scale. The others: see ``published_studies``.

    Returns
    -------
    StudyResults
        Its ``description`` has the exact "command", the "versions", and the "hours" it took on which machine.
    """
    with as_file(files("stairlab") / "data") as folder:
        return StudyResults.load(folder / one_of("part", part, published_studies()))


def published_studies() -> list[str]:
    """Name the studies that come with the package."""
    return sorted(entry.name for entry in (files("stairlab") / "data").iterdir() if entry.is_dir())


def _gathered(folders: Sequence[Path], records: Sequence[Mapping[str, Any]], file: str) -> pd.DataFrame:
    """Stack one table of all runs, with method and seed."""
    tables = [
        pd.read_csv(path).assign(method=record["method"], seed=record["seed"])
        for folder, record in zip(folders, records, strict=True)
        if (path := folder / f"{file}.csv").exists()  # SAC has no motions
    ]
    if not tables:
        return pd.DataFrame(columns=["method", "seed"])
    table = pd.concat(tables, ignore_index=True)
    return table[["method", "seed", *(name for name in table if name not in ("method", "seed"))]]


def _row(record: dict[str, Any]) -> dict[str, Any]:
    plan = record["plan"] or {}
    return {
        "method": record["method"],
        "seed": record["seed"],
        "score": record["score"],
        "actions": record["actions"],
        "samples": record["samples"],
        "best_return": plan.get("value"),
        "bound": plan.get("bound"),
        "proved": plan.get("proved"),
        "simulated": plan.get("simulated"),
        **{f"seconds_{name}": seconds for name, seconds in record["seconds"].items()},
        **{f"parameters_{name}".replace(" ", "_"): number for name, number in record["parameters"].items()},
    }


def _end(episode: pd.DataFrame) -> dict[str, Any]:
    last, y, z = episode.iloc[-1], episode["y"].to_numpy(), episode["z"].to_numpy()
    moved = np.abs(np.diff(y[-STUCK_JUMPS - 1 :])) + np.abs(np.diff(z[-STUCK_JUMPS - 1 :]))
    still = len(moved) == STUCK_JUMPS and (moved < STUCK_SHIFT).all()
    end = "top" if last["steps"] == TOP_STEP else "stuck" if still else "other"
    riser = Staircase.fifteen().next_riser(last["y"])
    return {"step": int(last["steps"]), "to riser": riser - last["y"] - CUBE_EDGE / 2, "end": end}


def _replayed(staircase: Staircase, motions: np.ndarray) -> StairWorld:
    """Return the world after some jumps from the start, at the precision of the environment's actions."""
    world = StairWorld(staircase)
    for motion in motions.astype(np.float32).astype(float):
        world.perform(motion)
    return world


def _effect(world: StairWorld, motion: np.ndarray) -> tuple[float, float]:
    """Return dy and dz of a motion from where the cube stands, and leave it there [m]."""
    jump = copy.copy(world).perform(motion.astype(np.float32).astype(float))
    return jump.dy, jump.dz


# Statistics over seeds, which are the last axis.


def iqm(values: np.ndarray, axis: int = -1) -> np.ndarray:
    """Return the interquartile mean: of the middle half of the values."""
    return trim_mean(values, 0.25, axis=axis)


def _mean_difference(x: np.ndarray, y: np.ndarray, axis: int = -1) -> np.ndarray:
    return x.mean(axis=axis) - y.mean(axis=axis)


def _deviation(values: np.ndarray, axis: int = -1) -> np.ndarray:
    return values.std(axis=axis, ddof=1)


def _improvement(x: np.ndarray, y: np.ndarray, axis: int = -1) -> np.ndarray:
    u = mannwhitneyu(x, y, axis=axis, method="asymptotic").statistic
    return u / (x.shape[axis] * y.shape[axis])


def _half_step(steps: np.ndarray) -> Callable[..., np.ndarray]:
    """Return the statistic of curves, shape (n_steps, n_seeds): the first of ``steps`` at which their mean is half of its maximum."""

    def statistic(curves: np.ndarray, axis: int = -1) -> np.ndarray:
        mean = curves.mean(axis=axis)
        reached = mean >= mean.max(axis=0) / 2
        return steps[reached.argmax(axis=0)].astype(float)

    return statistic


def _interval(statistic: Callable[..., np.ndarray], *samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the percentile bootstrap interval over seeds, NaN with too few of them."""
    if min(sample.shape[-1] for sample in samples) < FEWEST_SEEDS:
        nan = np.full(np.shape(statistic(*samples, axis=-1)), np.nan)
        return nan, nan
    found = bootstrap(
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
    return found.confidence_interval


def _estimate(statistic: Callable[..., np.ndarray], *samples: np.ndarray) -> Estimate:
    low, high = _interval(statistic, *samples)
    return Estimate(float(statistic(*samples, axis=-1)), float(low), float(high))
