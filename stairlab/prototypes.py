"""Action prototype generation: equations 2 to 4 of the paper, the sets it is compared with, and how reliable a set is."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pandas as pd
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from stairlab._files import Table, read_table, write_whole
from stairlab._validation import Seed, finite_array, one_of, read_only, seed_sequence, whole_number
from stairlab.clustering import KMeans, RobustGrowingNeuralGas
from stairlab.effects import EffectClasses
from stairlab.sampling import draw_motion, motion_grid, noisy_motions, replay_motions
from stairlab.world import World, check_world

MAX_COUNT = 10
""" No class gets more prototypes than this """
LARGEST_CV = 0.999999
""" cv is clipped here, so that (1 - cv) std stays positive """
NOISY_REPLAYS = 20
""" Replays of each prototype under noise, and exact ones in a random world """
NEIGHBOURS = 20
""" Neighbours, among all samples, that are asked whether they are of the same class """
CORE = 0.5
""" Share of a class that ``refine="core"`` leaves to RGNG """


@dataclass(frozen=True, eq=False)
class Prototypes:
    """A set of motions to choose from, and where it came from.

    Attributes
    ----------
    motions : ndarray of shape (n_prototypes, n_motion_parameters)
        For the stairs: magnitude [N] and angle [deg].
    classes : ndarray of shape (n_prototypes,), int, or None
        Effect class that each stands for, from 1; None for a set that knows no effects.
    method : str
        "effect", "fixed", "uniform" or "random", or any name for a set of one's own.
    seed : str
        The seed it was made with.
    settings : dict
        All other settings.
    motion_names : tuple of str
        Names of the motion parameters.

    Raises
    ------
    ValueError
        If the motions are not finite, there is none, or there is not one class for each.
    """

    motions: np.ndarray
    classes: np.ndarray | None = None
    method: str = "own"
    seed: str = ""
    settings: dict[str, Any] = field(default_factory=dict)
    motion_names: tuple[str, ...] = ("magnitude", "angle")

    def __post_init__(self) -> None:
        motions = finite_array("motions", self.motions, columns=len(self.motion_names))
        object.__setattr__(self, "motions", read_only(motions))
        if self.classes is not None:
            classes = finite_array("classes", self.classes, ndim=1)
            if classes.shape != (len(motions),) or classes.min() < 1 or (classes % 1).any():
                raise ValueError(
                    f"classes must hold a number from 1 for each of {len(motions)} motions, not {self.classes}."
                )
            object.__setattr__(self, "classes", read_only(classes.astype(int)))

    def __len__(self) -> int:
        return len(self.motions)

    def __repr__(self) -> str:
        return f"Prototypes({len(self)} motions, method={self.method!r}, seed={self.seed!r})"

    def of_class(self, number: int) -> np.ndarray:
        """Return the prototypes p_k of a class, shape (xi_k, n_motion_parameters); none if the set knows no classes."""
        return self.motions[:0] if self.classes is None else self.motions[self.classes == number]

    def to_frame(self) -> pd.DataFrame:
        """Return a table with a row for each prototype: its motion, and its class where there is one."""
        frame = pd.DataFrame(self.motions, columns=list(self.motion_names))
        return frame if self.classes is None else frame.assign(**{"class": self.classes})

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write motions and classes, with method, seed and settings in the header; the file appears whole or not at all."""
        header = {"method": self.method, "seed": self.seed, "settings": self.settings}

        def write(file: TextIO) -> None:
            file.writelines(f"# {key}: {json.dumps(value)}\n" for key, value in header.items())
            self.to_frame().to_csv(file, index=False, lineterminator="\n")

        write_whole(path, write)

    @classmethod
    def from_csv(
        cls, path: str | os.PathLike[str], motion_names: tuple[str, ...] = ("magnitude", "angle")
    ) -> Prototypes:
        """Read prototypes, or any table with a column for each motion parameter.

        Parameters
        ----------
        path : str or path-like
            The file.
        motion_names : tuple of str
            Names of the columns that hold the motions.

        Returns
        -------
        Prototypes

        Raises
        ------
        ValueError
            If the file is not such a table; the message names the file, and the line and column at fault.
        OSError
            If it cannot be read.
        """
        table = read_table(path)
        classes = None
        if "class" in table.header:
            classes = table.numbers(["class"], limits={"class": (1, 1e6)})[:, 0]
            if (broken := classes % 1 > 0).any():
                line, number = table.rows[int(np.argmax(broken))][0], classes[broken][0]
                raise ValueError(f"{table.name}, line {line}, column class: expected a whole number, found {number}.")
        return cls(table.numbers(motion_names), classes, motion_names=motion_names, **_header(table, Path(path).stem))


def _header(table: Table, name: str) -> dict[str, Any]:
    """Read method, seed and settings from a table's comments; a set that says nothing has its file's name as method."""
    found: dict[str, Any] = {"method": name}
    for line, comment in table.comments:
        key, colon, text = comment.removeprefix("#").strip().partition(": ")
        if not colon or key not in ("method", "seed", "settings"):
            continue
        try:
            value = json.loads(text)
        except json.JSONDecodeError:
            value = text
        expected = dict if key == "settings" else str
        if not isinstance(value, expected):
            if key == "settings":
                raise ValueError(
                    f"{table.name}, line {line}: expected a JSON object after 'settings: ', found {text!r}."
                )
            value = text
        found[key] = value
    return found


def prototype_counts(classes: EffectClasses, cap: int = MAX_COUNT) -> pd.DataFrame:
    r"""Count the prototypes that each effect class deserves (equations 2 and 3).

    .. math:: \xi_k = \left\lfloor \frac{(1 - cv_k) \, std_k}{\min_k (1 - cv_k) \, std_k} \right\rfloor, \quad
              cv_k = \frac{\sigma_k}{\mu_k}

    For each class, :math:`\mu_k` is the sum of the mean effects over the clustered dimensions, :math:`\sigma_k` the sum of the
    standard deviations (ddof = 1); both are divided by the largest of all these numbers, as in the authors' code. That one
    divisor cancels in both equations.

    Parameters
    ----------
    classes : EffectClasses
        The classes.
    cap : int
        Largest count.

    Returns
    -------
    pandas.DataFrame
        A row for each class: "size", normalised "mean" and "std", "cv" (clipped to 0.999999), "weight" (1 - cv) std, and "xi". A
        class of one sample gets xi = 1 and does not enter the minimum.

    Warns
    -----
    UserWarning
        If a class's cv exceeds 1 or is negative (the formula then no longer means what the paper says), or the smallest weight is
        below a thousandth of their median (the counts are then noise: on dz alone, the spreads are the solver's jitter).
    """
    if not isinstance(classes, EffectClasses):
        raise TypeError(f"classes must be EffectClasses, not {type(classes).__name__}.")
    cap = whole_number("cap", cap, low=1)
    mean, std = classes.means.sum(axis=1), classes.stds.sum(axis=1)
    divisor = max(mean.max(), std.max())
    mean, std = (mean / divisor, std / divisor) if divisor > 0 else (mean, std)
    counted = classes.sizes > 1
    with np.errstate(divide="ignore", invalid="ignore"):
        cv = np.nan_to_num(std / mean, nan=0.0, posinf=np.inf, neginf=-np.inf)
    _warn_of_odd_cv(cv, counted)
    cv = np.clip(cv, -1e6, LARGEST_CV)
    weight = (1 - cv) * std
    xi = np.ones(classes.n_classes, dtype=int)
    if counted.any():
        _warn_of_tiny_weight(weight, counted)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.nan_to_num(weight[counted] / weight[counted].min(), nan=1.0, posinf=cap)
        xi[counted] = np.clip(np.floor(ratio), 1, cap)
    index = pd.Index(classes.numbers, name="class")
    return pd.DataFrame(
        {"size": classes.sizes, "mean": mean, "std": std, "cv": cv, "weight": weight, "xi": xi}, index=index
    )


def _warn_of_odd_cv(cv: np.ndarray, counted: np.ndarray) -> None:
    odd = {f"C_{i + 1}": round(float(cv[i]), 2) for i in np.flatnonzero(counted & ((cv > 1) | (cv < 0)))}
    if odd:
        warnings.warn(
            f"The coefficient of variation leaves [0, 1] for {odd}: its mean effect is negative or smaller than its spread, and "
            f"equation 2 no longer favours reliable classes. It is clipped to at most {LARGEST_CV}.",
            stacklevel=3,
        )


def _warn_of_tiny_weight(weight: np.ndarray, counted: np.ndarray) -> None:
    smallest = np.flatnonzero(counted)[weight[counted].argmin()]
    if weight[smallest] < np.median(weight[counted]) / 1000:
        warnings.warn(
            f"C_{smallest + 1} has a weight of {weight[smallest]:.2g}, less than a thousandth of the median: all counts are divided "
            "by it, so they say more about jitter in that class than about the others.",
            stacklevel=3,
        )


def effect_prototypes(
    classes: EffectClasses,
    seed: Seed = 0,
    *,
    counts: pd.DataFrame | None = None,
    fixed: int | None = None,
    single: str = "mean",
    refine: str = "none",
    place: str = "rgng",
    world: World | None = None,
) -> Prototypes:
    r"""Generate action prototypes from effect classes (equation 4).

    .. math:: p_k = \begin{cases} \mu_k^m & \text{if } \xi_k = 1 \\ \mathrm{RGNG}(\xi_k) & \text{if } \xi_k > 1 \end{cases}

    Motions are standardised over all clustered samples (mean 0, standard deviation 1), and back after. xi_k is the largest number of
    nodes that robust growing neural gas may use: it keeps the network with the smallest description length, which may be smaller.

    Parameters
    ----------
    classes : EffectClasses
        The classes.
    seed : int or numpy.random.SeedSequence
        For RGNG; class k has child k.
    counts : pandas.DataFrame, optional
        With a column "xi"; by default those of ``prototype_counts``. A class with xi = 0 gets no prototype.
    fixed : int, optional
        The same count for every class instead (5 is the paper's method (b), figure 3b).
    single : {"mean", "nearest-effect"}
        Where xi_k = 1: the class's mean motion (the paper), or the sample whose effect is nearest to the class's mean effect (the
        authors' released package).
    refine : {"none", "nearest", "central", "agreeing", "core"}
        "none" is the paper; the others aim at reliable effects, and none looks at a reward. Three replace each prototype by an
        observed motion of its class: "nearest" by the nearest one; among the class's motions that are nearer to this prototype
        than to its others, "central" takes the one deepest inside the class (farthest from any motion of another class),
        "agreeing" the one whose 20 nearest neighbours among all samples agree most. "core" leaves the paper's method as it is,
        but shows it only the half of the class's motions whose neighbours agree most.
    place : {"rgng", "k-means"}
        What places more than one prototype: robust growing neural gas (the paper), or K-Means, whose centres are as many as were asked
        for.
    world : World, optional
        Where given, prototypes are clipped to its motion space (by default to the range of the samples' motions).

    Returns
    -------
    Prototypes

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described.
    """
    if not isinstance(classes, EffectClasses):
        raise TypeError(f"classes must be EffectClasses, not {type(classes).__name__}.")
    one_of("single", single, ("mean", "nearest-effect"))
    refiner = REFINERS[one_of("refine", refine, REFINERS)]
    placer = PLACERS[one_of("place", place, PLACERS)]
    members_of = _core if refine == "core" else _MotionSpace.members
    xi = _counts_to_use(classes, counts, fixed)
    space = _MotionSpace(classes)
    low, high = (
        (check_world(world).motion_low, world.motion_high)
        if world is not None
        else (classes.samples.motions.min(0), classes.samples.motions.max(0))
    )
    found = []
    for number, child in zip(
        classes.numbers, seed_sequence(seed, "effect prototypes").spawn(classes.n_classes), strict=True
    ):
        if xi[number - 1] == 0:
            found.append(space.points[:0])
            continue
        if single == "nearest-effect" and xi[number - 1] == 1:
            nodes = _with_nearest_effect(classes, space, number)
        else:
            nodes = _place(members_of(space, number), int(xi[number - 1]), placer, child)
        found.append(np.clip(space.motions(refiner(space, number, nodes)), low, high))
    return Prototypes(
        np.vstack(found),
        np.repeat(classes.numbers, [len(motions) for motions in found]),
        method="effect" if fixed is None else "fixed",
        seed=_seed_name(seed),
        settings={"xi": xi.tolist(), "single": single, "refine": refine, "place": place, "classes": classes.settings},
        motion_names=classes.samples.motion_names,
    )


def _counts_to_use(classes: EffectClasses, counts: pd.DataFrame | None, fixed: int | None) -> np.ndarray:
    if fixed is not None and counts is not None:
        raise ValueError("counts and fixed must not be given both.")
    if fixed is not None:
        return np.full(classes.n_classes, whole_number("fixed", fixed, low=1))
    counts = prototype_counts(classes) if counts is None else counts
    if not isinstance(counts, pd.DataFrame) or "xi" not in counts:
        raise TypeError(
            f"counts must be a table with a column 'xi', as prototype_counts returns it, not {type(counts).__name__}."
        )
    xi = finite_array("counts['xi']", counts["xi"].reindex(classes.numbers), ndim=1)
    if (xi < 0).any() or (xi % 1).any() or not xi.any():
        raise ValueError(
            f"counts must hold a whole xi of 0 or more for each of {classes.n_classes} classes, not all 0, and not {xi.tolist()}."
        )
    return xi.astype(int)


class _MotionSpace:
    """The standardised motions of all samples: mean 0, standard deviation 1 over the clustered ones."""

    def __init__(self, classes: EffectClasses) -> None:
        clustered = classes.samples.motions[classes.labels > 0]
        self.mean, self.std = clustered.mean(axis=0), clustered.std(axis=0)
        self.std[self.std == 0] = 1.0
        self.points = (classes.samples.motions - self.mean) / self.std
        self.labels = classes.labels

    def motions(self, points: np.ndarray) -> np.ndarray:
        """Return standardised motions in their units."""
        return points * self.std + self.mean

    def members(self, number: int) -> np.ndarray:
        """Return the standardised motions of a class."""
        return self.points[self.labels == number]


_Placer = Callable[[np.ndarray, int, np.random.SeedSequence], np.ndarray]


def _place(members: np.ndarray, xi: int, placer: _Placer, seed: np.random.SeedSequence) -> np.ndarray:
    """Place prototypes among a class's motions: their mean for one, RGNG or K-Means for more."""
    xi = min(xi, len(np.unique(members, axis=0)))
    return members.mean(axis=0, keepdims=True) if xi == 1 else placer(members, xi, seed)


def _by_rgng(members: np.ndarray, xi: int, seed: np.random.SeedSequence) -> np.ndarray:
    return RobustGrowingNeuralGas(max_nodes=xi, random_state=seed).fit(members).nodes_


def _by_kmeans(members: np.ndarray, xi: int, seed: np.random.SeedSequence) -> np.ndarray:
    return KMeans(n_clusters=xi, random_state=seed).fit(members).cluster_centers_


PLACERS: dict[str, _Placer] = {"rgng": _by_rgng, "k-means": _by_kmeans}


def _with_nearest_effect(classes: EffectClasses, space: _MotionSpace, number: int) -> np.ndarray:
    effects = classes.samples.effect(*classes.features)[classes.labels == number]
    nearest = np.linalg.norm(effects - classes.means[number - 1], axis=1).argmin()
    return space.members(number)[[nearest]]


def _agreement(space: _MotionSpace, number: int) -> np.ndarray:
    """Share of each member's nearest neighbours that are of its class (itself counted in), shape (size,)."""
    asked = min(NEIGHBOURS + 1, len(space.points))
    neighbours = KDTree(space.points).query(space.members(number), k=asked)[1].reshape(-1, asked)
    return (space.labels[neighbours] == number).mean(axis=1)


def class_agreement(classes: EffectClasses) -> np.ndarray:
    """Return how well each class can be brought about: the largest share of like neighbours that a motion of the class has.

    Asked are the motion and its 20 nearest neighbours among all samples, in standardised motion space. Where the samples start from
    many states, a share near 1 says that some motion has this effect from nearly all of them.

    Returns
    -------
    ndarray of shape (n_classes,)
        From 0 to 1.
    """
    space = _MotionSpace(classes)
    return np.array([_agreement(space, number).max() for number in classes.numbers])


def _core(space: _MotionSpace, number: int) -> np.ndarray:
    """Return the share CORE of a class's motions whose neighbours agree most; two at least, where there are two."""
    members = space.members(number)
    size = max(math.ceil(CORE * len(members)), min(len(members), 2))
    return members[np.argsort(-_agreement(space, number), kind="stable")[:size]]


def _leave(space: _MotionSpace, number: int, nodes: np.ndarray) -> np.ndarray:
    return nodes


def _nearest_observed(space: _MotionSpace, number: int, nodes: np.ndarray) -> np.ndarray:
    members = space.members(number)
    return members[cdist(nodes, members).argmin(axis=1)]


def _most_central(space: _MotionSpace, number: int, nodes: np.ndarray) -> np.ndarray:
    others = space.points[space.labels != number]
    depth = KDTree(others).query(space.members(number))[0] if len(others) else np.zeros(len(space.members(number)))
    return _best_in_each_cell(space.members(number), nodes, depth)


def _most_agreeing(space: _MotionSpace, number: int, nodes: np.ndarray) -> np.ndarray:
    return _best_in_each_cell(space.members(number), nodes, _agreement(space, number))


def _best_in_each_cell(members: np.ndarray, nodes: np.ndarray, score: np.ndarray) -> np.ndarray:
    """For each node, among the members nearest to it, the one with the best score; of equals the one nearest to the node."""
    distances = cdist(members, nodes)
    cell = distances.argmin(axis=1)
    chosen = []
    for node in np.unique(cell):
        inside = np.flatnonzero(cell == node)
        chosen.append(inside[np.lexsort((distances[inside, node], -score[inside]))[0]])
    return members[chosen]


REFINERS: dict[str, Callable[[_MotionSpace, int, np.ndarray], np.ndarray]] = {
    "none": _leave,
    "nearest": _nearest_observed,
    "central": _most_central,
    "agreeing": _most_agreeing,
    "core": _leave,
}


def uniform_prototypes(
    world: World, per_side: int = 4, *, n: int | None = None, seed: Seed | None = None
) -> Prototypes:
    """Return a regular grid over the motion space, corners included (figure 3d): 16 prototypes for the stairs.

    Parameters
    ----------
    world : World
        Its motion space is used.
    per_side : int
        Prototypes along each motion parameter, 2 or more.
    n : int, optional
        As many prototypes as this instead, 4 or more, where a motion has two parameters: as near to a square grid as there is, in
        rows of equal distance (of the second parameter), some of which hold one more.
    seed : int or numpy.random.SeedSequence, optional
        Shift the grid by an offset drawn from it: the motion space is cut into ``per_side`` cells along each parameter, and each
        prototype lies at the same place within its cell. No prototype is a corner of the motion space then.

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described.
    """
    check_world(world)
    settings: dict[str, Any]
    if n is not None and seed is not None:
        raise ValueError("n and seed must not be given both: only a square grid can be shifted.")
    if n is None:
        settings = {
            "per_side": whole_number("per_side", per_side, low=2),
            **({} if seed is None else {"shifted": True}),
        }
        motions = motion_grid(world, per_side)
        if seed is not None:
            offset = np.random.default_rng(seed_sequence(seed, "shifted grid")).random(motions.shape[1])
            low, high = np.asarray(world.motion_low), np.asarray(world.motion_high)
            cell = (high - low) / per_side
            motions = low + cell * (np.rint((motions - low) / (high - low) * (per_side - 1)) + offset)
    else:
        settings = {"n": whole_number("n", n, low=4)}
        motions = _rows(world, n)
    return Prototypes(
        motions,
        method="uniform",
        seed="" if seed is None else _seed_name(seed),
        settings=settings,
        motion_names=tuple(world.motion_names),
    )


def _rows(world: World, n: int) -> np.ndarray:
    """Return n motions in rows, the longer rows first; shape (n, 2)."""
    if len(world.motion_names) != 2:
        raise ValueError(f"n needs a world with two motion parameters, not {len(world.motion_names)}; use per_side.")
    (low, first), (high, last) = (np.asarray(bound).tolist() for bound in (world.motion_low, world.motion_high))
    n_rows = round(math.sqrt(n))
    sizes = [len(row) for row in np.array_split(np.arange(n), n_rows)]
    second = np.repeat(np.linspace(first, last, n_rows), sizes)
    return np.column_stack([np.concatenate([np.linspace(low, high, size) for size in sizes]), second])


def random_prototypes(world: World, n: int = 10, seed: Seed = 0) -> Prototypes:
    """Draw prototypes uniformly from the motion space (figure 3c).

    Parameters
    ----------
    world : World
        Its motion space is used.
    n : int
        Number of prototypes.
    seed : int or numpy.random.SeedSequence
        Prototype i is drawn from child i.
    """
    check_world(world)
    children = seed_sequence(seed, "random prototypes").spawn(whole_number("n", n, low=1))
    motions = np.array([draw_motion(world, np.random.default_rng(child)) for child in children])
    names = tuple(world.motion_names)
    return Prototypes(motions, method="random", seed=_seed_name(seed), settings={"n": n}, motion_names=names)


def _seed_name(seed: Seed) -> str:
    sequence = seed_sequence(seed)
    return "/".join(str(part) for part in (sequence.entropy, *sequence.spawn_key))


@dataclass(frozen=True, eq=False)
class Reliability:
    """What becomes of a set of prototypes when they are performed from the start pose.

    In a random world an exact replay is a draw: shares are then means, over the prototypes, of the shares of many replays.

    Attributes
    ----------
    exact : float
        Share of prototypes whose replay ends on the map in their own class (nearest mean effect); NaN for a set without classes.
    noisy : float
        The same under noise on the motion; NaN for a set without classes.
    on_map : float
        Share of prototypes whose replay ends on the map.
    classes_reached : int
        Number of classes in the table's column "reached".
    table : pandas.DataFrame
        A row for each prototype: its motion, its class (0 without), the class "reached" (0 off the map; in a random world the one
        reached most often, of several the first), and the shares of noisy replays that end on the map and in its own class. In a
        random world also those of the exact replays, "on map" and "in class".
    """

    exact: float
    noisy: float
    on_map: float
    classes_reached: int
    table: pd.DataFrame


def reliability(
    world: World, prototypes: Prototypes, classes: EffectClasses, seed: Seed = 0, *, replays: int = NOISY_REPLAYS
) -> Reliability:
    """Measure how reliably prototypes produce their effects, by replaying them from the start pose.

    Noise is Gaussian, as large as the world says (``noise_scale``; for the stairs 2 % of the magnitude and 1 degree), and a noisy
    motion is clipped to the motion space.

    A world that is random (``world.random``; in the tumbling world, the cube rocks) answers equal motions with unequal effects. There
    the unperturbed motion, too, is replayed several times, each with a draw of its own, and "exact" means that nothing is added to
    what the world draws.

    Parameters
    ----------
    world : World
        Where to replay. One that does not say whether it is random is not.
    prototypes : Prototypes
        The set.
    classes : EffectClasses
        The classes that effects are sorted into, by the nearest mean effect in the clustered dimensions.
    seed : int or numpy.random.SeedSequence
        For the noise, and for worlds with randomness of their own.
    replays : int
        Noisy replays of each prototype; in a random world, exact ones as well.

    Returns
    -------
    Reliability

    Raises
    ------
    ValueError
        If the classes are fewer than those of the prototypes.
    """
    check_world(world)
    if not isinstance(prototypes, Prototypes):
        raise TypeError(f"prototypes must be Prototypes, not {type(prototypes).__name__}.")
    if not isinstance(classes, EffectClasses):
        raise TypeError(f"classes must be EffectClasses, not {type(classes).__name__}.")
    if prototypes.classes is not None and prototypes.classes.max() > classes.n_classes:
        raise ValueError(
            f"prototypes must belong to the {classes.n_classes} given classes, but one is of class {prototypes.classes.max()}."
        )
    replays = whole_number("replays", replays, low=1)
    own = np.zeros(len(prototypes), int) if prototypes.classes is None else prototypes.classes
    for_exact, for_noise, for_noisy = seed_sequence(seed, "reliability").spawn(3)
    is_random = bool(getattr(world, "random", False))
    repeated = np.repeat(prototypes.motions, replays if is_random else 1, axis=0)
    exact = classes.reached(replay_motions(world, repeated, for_exact)).reshape(len(prototypes), -1)
    reached = np.array([np.bincount(row).argmax() for row in exact])
    tries = [
        noisy_motions(world, np.tile(motion, (replays, 1)), np.random.default_rng(child))
        for motion, child in zip(prototypes.motions, for_noise.spawn(len(prototypes)), strict=True)
    ]
    noisy = classes.reached(replay_motions(world, np.vstack(tries), for_noisy)).reshape(len(prototypes), replays)
    has_classes = prototypes.classes is not None
    kept, noisy_kept = exact == own[:, None], noisy == own[:, None]
    shares = {"on map": (exact > 0).mean(axis=1), "in class": kept.mean(axis=1) if has_classes else np.nan}
    table = prototypes.to_frame().assign(
        **{
            "class": own,
            "reached": reached,
            **(shares if is_random else {}),
            "noisy on map": (noisy > 0).mean(axis=1),
            "noisy in class": noisy_kept.mean(axis=1) if has_classes else np.nan,
        }
    )
    return Reliability(
        exact=float(kept.mean()) if has_classes else float("nan"),
        noisy=float(noisy_kept.mean()) if has_classes else float("nan"),
        on_map=float((exact > 0).mean()),
        classes_reached=len(set(reached.tolist()) - {0}),
        table=table,
    )
