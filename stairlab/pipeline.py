"""The whole paper up to its action prototypes in one call: sample, classify, count, place, compare, measure."""

from __future__ import annotations

import platform
import warnings
from collections import Counter
from dataclasses import dataclass, field
from importlib.metadata import version

import numpy as np
import pandas as pd
from tqdm import tqdm

from stairlab import __version__
from stairlab._validation import seed_sequence, whole_number
from stairlab.effects import PRESETS, EffectClasses
from stairlab.prototypes import (
    NOISY_REPLAYS,
    Prototypes,
    Reliability,
    effect_prototypes,
    prototype_counts,
    random_prototypes,
    reliability,
    uniform_prototypes,
)
from stairlab.sampling import Samples, sample_motions
from stairlab.tumbling import stair_world
from stairlab.world import CubeWorld, Jump

FIXED = 5
""" Prototypes for each class in the paper's method (b) """
RESAMPLES = 10
""" Resamples of the drifting jumps that tell how classes merge when x takes part """
EXAMPLE_MOTION = (450.0, 65.0)
""" The jump of figure 1: magnitude [N] and angle [deg] """
METHODS = {
    "effect": "effect (the paper)",
    "fixed": "effect, fixed {}",
    "uniform": "uniform",
    "random": "random",
    "nearest": "effect, nearest",
    "central": "effect, central",
    "agreeing": "effect, agreeing",
    "core": "effect, core",
}
""" The sets of prototypes that a run compares, and what each is called """
VARIANTS = ("nearest", "central", "agreeing", "core")


@dataclass(frozen=True, eq=False)
class Run:
    """All results of one run of the paper's method. Made by ``run_pipeline``.

    Attributes
    ----------
    n, seed, replays : int
        What the run was asked for.
    world : StairWorld or TumblingWorld
        Where it took place.
    example : Jump
        One jump with its trajectory, for figure 1.
    samples : Samples
        All jumps (Algorithm 1).
    classes : EffectClasses
        Effect classes on (dy, dz), by the default preset (Algorithm 2).
    presets : dict of str to EffectClasses
        The classes by each preset that could be followed, the default one first.
    counts : pandas.DataFrame
        The prototype count of each class (equations 2 and 3).
    prototypes : dict of str to Prototypes
        The sets "effect" (equation 4), "fixed", "uniform", "random", and the variants "nearest", "central", "agreeing", "core".
    reliability : dict of str to Reliability
        What each set does, exactly and under noise.
    classes_x : EffectClasses
        Classes on (dx, dy, dz) of the same jumps, in the plane with x drift on (Appendix C).
    together : str
        Which classes share a class on (dx, dy, dz), where most of their jumps are, such as "C1+C2, C3+C4, C5+C6".
    merges : pandas.DataFrame
        The same for resamples of those jumps, a row for each: the number of classes "without x" and "with x", and "together".
    notes : tuple of str
        Warnings, and what could not be computed and why.
    versions : dict of str to str
        Versions of Python and of the packages that results depend on.
    """

    n: int
    seed: int
    replays: int
    world: CubeWorld = field(repr=False)
    example: Jump = field(repr=False)
    samples: Samples = field(repr=False)
    classes: EffectClasses = field(repr=False)
    presets: dict[str, EffectClasses] = field(repr=False)
    counts: pd.DataFrame = field(repr=False)
    prototypes: dict[str, Prototypes] = field(repr=False)
    reliability: dict[str, Reliability] = field(repr=False)
    classes_x: EffectClasses = field(repr=False)
    together: str
    merges: pd.DataFrame = field(repr=False)
    notes: tuple[str, ...]
    versions: dict[str, str] = field(repr=False)

    def summary(self) -> pd.DataFrame:
        """Return a row for each set of prototypes.

        Returns
        -------
        pandas.DataFrame
            "method", number of "prototypes", share that ends in its own class "exact" and "under noise" (NaN for sets without
            classes), share that ends "on map", and number of "classes reached".
        """
        rows = [
            {
                "method": METHODS[name].format(FIXED),
                "prototypes": len(self.prototypes[name]),
                "exact": measured.exact,
                "under noise": measured.noisy,
                "on map": measured.on_map,
                "classes reached": measured.classes_reached,
            }
            for name, measured in self.reliability.items()
        ]
        return pd.DataFrame(rows)

    def scores(self) -> pd.DataFrame:
        """Return the score of each k by each preset: "preset", "criterion", "k", "score", and whether it was "chosen"."""
        tables = [
            classes.scores.assign(
                preset=name, criterion=classes.settings["criterion"], chosen=classes.scores["k"] == classes.n_classes
            )
            for name, classes in self.presets.items()
        ]
        return pd.concat(tables, ignore_index=True)[["preset", "criterion", "k", "score", "chosen"]]


def run_pipeline(
    n: int = 2000,
    seed: int = 0,
    n_jobs: int = 1,
    progress: bool = True,
    *,
    replays: int = NOISY_REPLAYS,
    world: str = "plane",
) -> Run:
    """Run the paper's method from the first random jump to measured action prototypes.

    All functions get the same seed, and each draws from a stream of its own, so equal arguments give
    equal results to the bit, for any number of processes.

    Parameters
    ----------
    n : int
        Number of jumps.
    seed : int
        Source of all randomness.
    n_jobs : int
        Processes for the jumps (joblib); -1 for all cores.
    progress : bool
        Show progress bars.
    replays : int
        Noisy replays of each prototype.
    world : {"plane", "tumbling"}
        Where the cube jumps: in the plane, where sideways drift is a small random model, or in three dimensions, where it turns and
        rolls.

    Returns
    -------
    Run

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described, or so few jumps end on the map that there are no classes to find.

    Examples
    --------
    >>> run = run_pipeline(n=200, progress=False)
    >>> save_run(run, "out")  # doctest: +SKIP
    """
    n, seed = whole_number("n", n, low=1), whole_number("seed", seed, low=0)
    replays = whole_number("replays", replays, low=1)
    place = stair_world(world)
    notes: list[str] = []
    samples = with_x = sample_motions(place, n, seed, n_jobs, progress=progress)
    if world == "plane":
        with_x = sample_motions(stair_world(world, x_drift=True), n, seed, n_jobs, progress=progress)
    with tqdm(total=3 + len(METHODS), desc="classes", disable=not progress, leave=False, delay=0.5) as bar:

        def now(what: str) -> None:
            bar.update()
            bar.set_description(what)

        presets = _presets(samples, seed, notes)
        classes = next(iter(presets.values()))
        now("Appendix C")
        classes_x = EffectClasses.from_samples(with_x, ("dx", "dy", "dz"), seed=seed)
        merges = _merges(with_x, seed, notes)
        now("prototypes")
        counts = _counts(classes, notes)
        sets = {
            "effect": effect_prototypes(classes, seed, counts=counts, world=place),
            "fixed": effect_prototypes(classes, seed, fixed=FIXED, world=place),
            "uniform": uniform_prototypes(place),
            "random": random_prototypes(place, seed=seed),
        }
        for name in VARIANTS:
            sets[name] = effect_prototypes(classes, seed, counts=counts, refine=name, world=place)
        measured = {}
        for name, prototypes in sets.items():
            now(f"replays: {name}")
            measured[name] = reliability(place, prototypes, classes, seed, replays=replays)
    return Run(
        n=n,
        seed=seed,
        replays=replays,
        world=place,
        example=stair_world(world).jump(*EXAMPLE_MOTION, trajectory=True),
        samples=samples,
        classes=classes,
        presets=presets,
        counts=counts,
        prototypes=sets,
        reliability=measured,
        classes_x=classes_x,
        together=together(classes, classes_x),
        merges=merges,
        notes=tuple(notes),
        versions=_versions(),
    )


def _presets(samples: Samples, seed: int, notes: list[str]) -> dict[str, EffectClasses]:
    """Follow each preset; the first, which the rest of the run builds on, must succeed."""
    found: dict[str, EffectClasses] = {}
    for name in PRESETS:
        try:
            found[name] = EffectClasses.from_samples(samples, preset=name, seed=seed)
        except ValueError as error:
            if not found:
                raise ValueError(
                    f"n must be larger: {int(samples.on_map.sum())} of {len(samples)} jumps ended on the map, too few for classes. "
                    f"{error}"
                ) from None
            notes.append(f"The preset {name} could not be followed: {error}")
    return found


def _counts(classes: EffectClasses, notes: list[str]) -> pd.DataFrame:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        counts = prototype_counts(classes)
    notes.extend(str(warning.message) for warning in caught)
    return counts


def _merges(samples: Samples, seed: int, notes: list[str]) -> pd.DataFrame:
    """Resample the jumps with replacement, and see which classes on (dy, dz) share a class on (dx, dy, dz)."""
    on_map, rows = samples.on_the_map(), []
    for child in seed_sequence(seed, "resamples").spawn(RESAMPLES):
        chosen = on_map[np.random.default_rng(child).integers(len(on_map), size=len(on_map))]
        try:
            without = EffectClasses.from_samples(chosen, seed=seed)
            with_x = EffectClasses.from_samples(chosen, ("dx", "dy", "dz"), seed=seed)
        except ValueError:  # too few distinct jumps
            continue
        rows.append((without.n_classes, with_x.n_classes, together(without, with_x)))
    if missing := RESAMPLES - len(rows):
        notes.append(
            f"{missing} of {RESAMPLES} resamples for Appendix C have too few distinct jumps for classes, and are left out."
        )
    return pd.DataFrame(rows, columns=["without x", "with x", "together"])


def together(classes: EffectClasses, others: EffectClasses) -> str:
    """Name the classes whose samples mostly fall into one class of ``others``, such as "C1+C2, C3"; both of the same samples."""
    groups: dict[int, list[str]] = {}
    for number in classes.numbers:
        ((home, _),) = Counter(others.labels[classes.labels == number].tolist()).most_common(1)
        groups.setdefault(home, []).append(f"C{number}")
    return ", ".join("+".join(group) for group in groups.values())


def _versions() -> dict[str, str]:
    packages = ("numpy", "pymunk", "pandas", "scipy", "numba", "matplotlib")
    return {"stairlab": __version__, "Python": platform.python_version()} | {name: version(name) for name in packages}
