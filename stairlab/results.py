"""What a study found: its tables, and what follows from them (section 4 of the paper, figure 4)."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from stairlab import endings
from stairlab._files import write_bytes, write_whole
from stairlab._validation import one_of
from stairlab.beyond import TUNED_DQN
from stairlab.endings import RUN
from stairlab.estimates import (
    Estimate,
    Statistic,
    deviation,
    difference_of,
    estimate,
    half_step,
    improvement,
    interval,
    iqm,
    p_value,
    peak,
)
from stairlab.physics import Staircase
from stairlab.tumbling import stair_world
from stairlab.world import CubeWorld

METHODS = {
    "effect": "effect-based prototypes (the paper's)",
    "effect-reliable": "effect-based prototypes from the core of each class",
    "fixed": "five prototypes a class",
    "uniform": "a 4 x 4 grid of motions",
    "random": "ten random motions",
    "uniform-matched": "a grid of as many motions as effect has",
    "random-matched": "as many random motions as effect has",
    "sac": "SAC on the continuous motion space",
}
""" What a study of the paper compares """
BEYOND = {
    "uniform-shifted": "a 4 x 4 grid with an offset of its own for each seed, without corners",
    "uniform-no-corners": "the 4 x 4 grid without its four corners",
    "effect-plus-steep": "effect-based prototypes and one motion of 600 N at 89 degrees",
    "along-stairs": "at most twenty prototypes found along the stairs (beyond.py)",
}
""" What it can compare besides """
ORDER = sorted([*METHODS, *BEYOND], key=lambda method: method == "sac")
""" In which methods are listed: SAC, which has no set, after the others; sets of one's own come last """
PLANE = {"world": "plane", "rocking": 1.0, "friction": 1.0, "as_published": False}
""" Settings of studies that were made before there was a choice """
TABLES = ("runs", "evaluations", "motions", "episodes")
STUDY_FILE = "study.json"
CHECKSUMS = "SHA256SUMS"
TOP_STEP = 15
""" Steps of the learning task """
RETURN_DIGITS = 4
""" Digits of the returns in tables: a leaning cube makes a difference of hundredths """
SAME_RETURN = 0.05
""" Returns as near as this are the same: a resting cube can lean, some hundredths of a step """


@dataclass(frozen=True, eq=False, repr=False)
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
        A row for each jump of a trained agent's greedy episodes, five where the world is random and else one: "episode" (from 0),
        "jump" (from 1), "action" (number of the motion in its set, from 0; -1 for SAC), "magnitude" [N], "angle" [deg]; where it ends,
        "x", "y", "z" [m], "yaw" [deg] and "steps"; and "reward". Older studies of the plane have no "action", "x" and "yaw".
    description : dict
        The study's "settings", its own sets ("own"), and the packages' "versions".
    """

    runs: pd.DataFrame
    evaluations: pd.DataFrame = field(repr=False)
    motions: pd.DataFrame = field(repr=False)
    episodes: pd.DataFrame = field(repr=False)
    description: dict[str, Any] = field(repr=False)

    def __repr__(self) -> str:
        seeds = self.runs.groupby("method", sort=False)["seed"].nunique()
        methods = ", ".join(f"{method} ({count})" for method, count in seeds.items())
        return f"StudyResults: {len(self.runs)} runs of {self.description['settings']['total_timesteps']:,} jumps; seeds: {methods}"

    @classmethod
    def from_runs(cls, folders: Sequence[Path], description: Mapping[str, Any]) -> StudyResults:
        """Read the folders of finished runs, in any order.

        Raises
        ------
        ValueError
            If there is none.

        Warns
        -----
        UserWarning
            If a run is damaged; it is left out.
        """
        description = {**description, "settings": PLANE | description["settings"]}
        whole = [folder for folder in folders if _is_whole(folder)]
        if not whole:
            raise ValueError("There must be a finished run to read, but there is none; run the study first.")
        found = [(json.loads((folder / "run.json").read_bytes()), folder) for folder in whole]
        records, folders = zip(*sorted(found, key=_place), strict=True)
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

    @classmethod
    def from_folder(cls, folder: str | PathLike[str]) -> StudyResults:
        """Read all finished runs of a study's folder, whichever commands made them.

        Raises
        ------
        ValueError
            If the folder holds no study, or no finished run.
        OSError
            If a file cannot be read.

        Warns
        -----
        UserWarning
            If a run is damaged; it is left out.
        """
        folder = Path(folder)
        try:
            description = json.loads((folder / STUDY_FILE).read_bytes())
        except (FileNotFoundError, NotADirectoryError, json.JSONDecodeError):
            raise ValueError(f"folder must hold a study, but {folder} has no readable {STUDY_FILE}.") from None
        return cls.from_runs([path.parent for path in folder.glob(f"*/{CHECKSUMS}")], description)

    def selected(self, methods: Iterable[str], seeds: Iterable[int]) -> StudyResults:
        """Return the runs of some methods and seeds."""
        tables = {name: getattr(self, name) for name in TABLES}
        chosen = {
            name: table[table["method"].isin(list(methods)) & table["seed"].isin(list(seeds))].reset_index(drop=True)
            for name, table in tables.items()
        }
        return StudyResults(description=self.description, **chosen)

    def with_effect_sets(self, method: str) -> StudyResults:
        """Return the results with another method in the place of "effect": what holds of our sets can then be asked of others.

        Raises
        ------
        ValueError
            If there is no such method.
        """
        one_of("method", method, self.methods)
        tables = {}
        for name in TABLES:
            table = getattr(self, name)
            table = table[(table["method"] != "effect") | (method == "effect")]
            tables[name] = table.assign(method=table["method"].replace(method, "effect")).reset_index(drop=True)
        return StudyResults(description=self.description, **tables)

    def joined(self, other: StudyResults) -> StudyResults:
        """Return these runs and those of another part of the same study; a run that both hold is taken from the other."""
        twice = set(other.runs[RUN].itertuples(index=False, name=None))
        tables = {}
        for name in TABLES:
            table = getattr(self, name)
            kept = table[[run not in twice for run in table[RUN].itertuples(index=False, name=None)]]
            both = pd.concat([part for part in (kept, getattr(other, name)) if len(part)], ignore_index=True)
            order = both[RUN].apply(lambda run: _place_of(*run), axis=1) if len(both) else both.index
            tables[name] = both.loc[order.sort_values(kind="stable").index].reset_index(drop=True)
        own = self.description["own"] | other.description["own"]
        return StudyResults(description={**other.description, "own": own}, **tables)

    def without_motions_of(self, methods: Iterable[str]) -> StudyResults:
        """Return the results without the motions of some sets: for sets whose motions are not ours to hand on."""
        methods = list(methods)
        hidden = self.episodes.copy()
        hidden.loc[hidden["method"].isin(methods), ["magnitude", "angle"]] = np.nan
        return StudyResults(
            self.runs, self.evaluations, self.motions[~self.motions["method"].isin(methods)], hidden, self.description
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
        low, high = interval(iqm, values)
        return pd.DataFrame({"iqm": iqm(values), "low": low, "high": high}, index=curves.index)

    def iqm_score(self, method: str) -> Estimate:
        """Estimate the interquartile mean of a method's scores."""
        return estimate(iqm, self.scores(method))

    def difference(self, method: str, other: str, of: str = "score") -> Estimate:
        """Estimate by how much a method is above another.

        Parameters
        ----------
        method, other : str
            The two methods.
        of : {"score", "spread", "half at", "peak"}
            Their mean score; the standard deviation of their scores; the training steps in which their mean curve rises half way; or
            the highest value of their mean curve.
        """
        statistic, (mine, theirs) = self._measured(of, method, other)
        return estimate(difference_of(statistic), mine, theirs)

    def p_value(self, method: str, other: str, of: str = "score", bound: float = 0.0) -> float:
        """Return the p-value of the claim that a ``difference`` is ``bound``, see ``stairlab.estimates.p_value``."""
        statistic, (mine, theirs) = self._measured(of, method, other)
        return p_value(difference_of(statistic), mine, theirs, bound=bound)

    def _measured(self, of: str, *methods: str) -> tuple[Statistic, list[np.ndarray]]:
        """Return a statistic, and of each method the sample that it is a statistic of."""
        of_scores: dict[str, Statistic] = {"score": np.mean, "spread": deviation}
        if one_of("of", of, (*of_scores, "half at", "peak")) in of_scores:
            return of_scores[of], [self.scores(method) for method in methods]
        curves = [self.curves(method) for method in methods]
        statistic = peak if of == "peak" else half_step(curves[0].index.to_numpy())
        return statistic, [curve.to_numpy() for curve in curves]

    def probability_of_improvement(self, method: str, other: str) -> Estimate:
        """Estimate the probability that a run of a method scores higher than one of another, ties counted half.

        Scores that agree to a thousandth are ties: how a cube leans moves them by less.
        """
        return estimate(improvement, *(self.scores(name).round(3) for name in (method, other)))

    def steps_to_half(self, method: str) -> Estimate:
        """Estimate when a method has risen half way: after how many training steps its mean curve is half way up.

        That is from its first to its highest value. A curve that never rises counts as reaching it at the end of the training. The
        samples of a set are not counted; see ``shift``.
        """
        curves = self.curves(method)
        return estimate(half_step(curves.index.to_numpy()), curves.to_numpy())

    def step_of(self, method: str, value: float) -> float:
        """Return the training step at which a method's mean curve first reaches a return, infinite if it never does."""
        mean = self.curves(method).mean(axis=1)
        reached = mean.index[mean >= value]
        return float(reached[0]) if len(reached) else np.inf

    def spread(self, method: str) -> Estimate:
        """Estimate the standard deviation of a method's scores over seeds."""
        return estimate(deviation, self.scores(method))

    def summary(self) -> pd.DataFrame:
        """Return a row for each method.

        Returns
        -------
        pandas.DataFrame
            "method"; number of "seeds" and, on average, of "actions"; the scores' "mean" and "sd", and their interquartile mean "iqm"
            with its 95 % interval "low" to "high" (NaN with five seeds or fewer); "at the top", the share of the trained agents'
            greedy episodes that end there; "half at", the training steps in which the mean curve rises half way, and "half of 15 at",
            those until it is 7.5 (infinite if it never is); "samples" that a set was made from; "best return", what the search found
            that the sets allow, on average, a lower bound; "allow 15", the share of sets for which it found 15; "proved", the share
            of sets for which nothing better is possible; and "quick", whether the numbers say nothing.
        """
        ends = self.ends()
        return pd.DataFrame([self._summary(method, ends[ends["method"] == method]) for method in self.methods])

    def _summary(self, method: str, ends: pd.DataFrame) -> dict[str, Any]:
        runs, scores = self._of("runs", method), self.scores(method)
        value, low, high = self.iqm_score(method)
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
            "at the top": (ends["end"] == "top").mean(),
            "half at": self.steps_to_half(method).value,
            "half of 15 at": self.step_of(method, TOP_STEP / 2),
            "samples": self.shift(method),
            "best return": runs["best_return"].mean(),
            "allow 15": (runs["best_return"] > TOP_STEP - SAME_RETURN).mean() if searched else np.nan,
            "proved": runs["proved"].astype(float).mean() if searched else np.nan,
            "quick": self.quick,
        }

    @property
    def _tumbles(self) -> bool:
        return self.description["settings"]["world"] == "tumbling"

    def ends(self) -> pd.DataFrame:
        """Say how the greedy episodes of each trained agent end, see ``stairlab.endings.ends``."""
        return endings.ends(self.episodes, self._tumbles)

    def ways_out(self, max_simulated: int = 700, progress: bool = False) -> pd.DataFrame:
        """Ask whether a set has a way up from where its trained agent got stuck, see ``stairlab.endings.ways_out``."""
        return endings.ways_out(self.episodes, self.motions, self.world, max_simulated, progress)

    def trapped(self) -> pd.DataFrame:
        """Count how often greedy agents lie in the trap before a riser, see ``stairlab.endings.trapped``."""
        return endings.trapped(self.episodes)

    def accounts(self) -> pd.DataFrame:
        """Say what greedy episodes earn and lose, see ``stairlab.endings.accounts``."""
        return endings.accounts(self.episodes)

    def thrown_off(self) -> pd.DataFrame:
        """Say how greedy agents leave the map, see ``stairlab.endings.thrown_off``."""
        return endings.thrown_off(self.episodes, self._tumbles)

    def traps(self) -> pd.DataFrame:
        """Measure the trap that a riser is for each set, see ``stairlab.endings.traps``; "score" is that of its run."""
        scores = self.runs[["method", "seed", "score"]]
        return endings.traps(self.motions, self.world).merge(scores, how="left", on=["method", "seed"])

    @property
    def world(self) -> CubeWorld:
        """The world of the learning task, with fifteen steps, as the study had it."""
        settings = PLANE | self.description["settings"]
        options = {name: settings[name] for name in ("rocking", "friction")}
        return stair_world(settings["world"], Staircase.fifteen(settings["restitution"]), **options)

    @property
    def hours(self) -> float:
        """Time that all runs took together, each on one core [h]."""
        return float(self.runs.filter(like="seconds_").sum().sum()) / 3600

    def command(self) -> str:
        """Return the commands that make this study, a line for each group of methods with the same seeds."""
        groups: dict[str, list[str]] = {}
        for method in self.methods:
            groups.setdefault(_ranges(sorted(self._of("runs", method)["seed"])), []).append(method)
        own, words = self.description["own"], " ".join(["stairlab study", *self._flags()])
        named = {method: f"{method}={method}.csv" if method in own else method for method in self.methods}
        return "\n".join(
            f"{words} --methods {' '.join(named[method] for method in methods)} --seeds {seeds}"
            for seeds, methods in groups.items()
        )

    def _flags(self) -> list[str]:
        settings = self.description["settings"]
        flags = ["--quick"] if self.quick else [f"--timesteps {settings['total_timesteps']}"]
        flags.append(f"--world {settings['world']}")
        if settings["dqn"] == TUNED_DQN:
            flags.append("--tuned")
        if settings["restitution"] is not None:
            flags.append(f"--restitution {settings['restitution']:g}")
        flags += [f"--{name} {settings[name]:g}" for name in ("rocking", "friction") if settings[name] != 1]
        if settings["as_published"]:
            flags.append("--as-published")
        return flags

    def save_tables(self, folder: str | PathLike[str]) -> list[Path]:
        """Write the tables and the description, for ``StudyResults.load``; the returns of evaluations to four digits."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        tables = {name: getattr(self, name) for name in TABLES}
        tables["evaluations"] = tables["evaluations"].round({"return": RETURN_DIGITS})
        for name, table in tables.items():
            write = partial(table.to_csv, index=False, lineterminator="\n")
            write_whole(folder / f"{name}.csv", write)
        write_bytes(folder / "description.json", (json.dumps(self.description, indent=1) + "\n").encode())
        return [folder / f"{name}.csv" for name in TABLES] + [folder / "description.json"]

    @classmethod
    def load(cls, folder: str | PathLike[str]) -> StudyResults:
        """Read what ``save_tables`` has written (a study writes it into its folder ``tables``).

        Raises
        ------
        ValueError
            If a file is not what ``save_tables`` writes.
        OSError
            If a file cannot be read.
        """
        folder, path = Path(folder), Path()
        try:
            tables = {name: pd.read_csv(path := folder / f"{name}.csv") for name in TABLES}
            if "episode" not in tables["episodes"]:  # of a study that was made when one was kept
                tables["episodes"].insert(2, "episode", 0)
            description = json.loads((path := folder / "description.json").read_bytes())
            return cls(description={**description, "settings": PLANE | description["settings"]}, **tables)
        except (ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{path} must be a file of a study's tables, but cannot be read as one: {error}") from None


def load_published_study(part: str = "tumbling") -> StudyResults:
    """Load the study that comes with the package.

    Parameters
    ----------
    part : str
        "tumbling", the comparison at the paper's scale in three dimensions, or another of ``published_studies``; "plane" is the same
        comparison in the plane.

    Returns
    -------
    StudyResults
        Its ``command()`` repeats it, its ``hours`` says how long it took, and its ``description`` has settings and versions.

    Raises
    ------
    ValueError
        If there is no such part.
    """
    with as_file(files("stairlab") / "data") as folder:
        return StudyResults.load(folder / one_of("part", part, published_studies()))


def published_studies() -> list[str]:
    """Name the studies that come with the package."""
    return sorted(entry.name for entry in (files("stairlab") / "data").iterdir() if entry.is_dir())


def _ranges(seeds: Sequence[int]) -> str:
    """Write seeds as the command takes them, such as "0-19 100"."""
    runs = np.split(np.array(seeds), np.flatnonzero(np.diff(seeds) > 1) + 1)
    return " ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)


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
        **{name: plan.get(name) for name in ("exhausted", "expanded", "merged", "simulated")},
        **{f"seconds_{name}": seconds for name, seconds in record["seconds"].items()},
        **{f"parameters_{name}".replace(" ", "_"): number for name, number in record["parameters"].items()},
    }


def damage(folder: str | PathLike[str]) -> str | None:
    """Say what is wrong with the folder of a run by its checksums, None if nothing is."""
    folder = Path(folder)
    try:
        sums = dict(line.split("  ")[::-1] for line in (folder / CHECKSUMS).read_text().removesuffix("\n").split("\n"))
    except (FileNotFoundError, ValueError):
        return f"{CHECKSUMS} is missing or unreadable"
    for name in ("run.json", *sums):
        try:
            content = (folder / name).read_bytes()
        except FileNotFoundError:
            return f"{name} is missing"
        if sums.get(name) != hashlib.sha256(content).hexdigest():
            return f"{name} is not what was written"
    return None


def _is_whole(folder: Path) -> bool:
    if fault := damage(folder):
        warnings.warn(f"The run {folder} is damaged ({fault}) and is left out.", stacklevel=4)
    return not fault


def _place(found: tuple[dict[str, Any], Path]) -> tuple[int, str, int]:
    return _place_of(found[0]["method"], found[0]["seed"])


def _place_of(method: str, seed: int) -> tuple[int, str, int]:
    """Order runs: the paper's methods first, and by seed."""
    return (ORDER.index(method) if method in ORDER else len(ORDER), method, seed)
