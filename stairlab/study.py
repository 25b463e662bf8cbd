"""The comparison of the paper (section 4, figure 4), with as many seeds as it takes: methods x seeds, run, resumed, spread.

A study is a folder with a folder for each run. A run appears whole or not at all and carries its checksums, so a study that was
killed goes on where it was, and what was damaged since is noticed.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import shutil
import threading
import time
import warnings
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from os import PathLike
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pandas as pd
from filelock import FileLock, Timeout
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from stairlab._files import write_bytes
from stairlab._validation import one_of, whole_number
from stairlab.agents import (
    EVAL_EPISODES,
    EVAL_EVERY,
    Training,
    check_budget,
    check_settings,
    count_parameters,
    greedy_steps,
    make_env,
    package_versions,
    train,
)
from stairlab.beyond import along_stairs_prototypes
from stairlab.effects import EffectClasses
from stairlab.physics import Staircase
from stairlab.planning import MAX_SIMULATED, Plan, best_return
from stairlab.prototypes import Prototypes, effect_prototypes, random_prototypes, uniform_prototypes
from stairlab.results import BEYOND, CHECKSUMS, METHODS, PLANE, STUDY_FILE, StudyResults, damage
from stairlab.sampling import sample_motions
from stairlab.tumbling import stair_world
from stairlab.world import CubeWorld, yaw_of

FIXED = 5
""" Prototypes a class for the method "fixed" """
STEEP = (600.0, 89.0)
""" The motion that "effect-plus-steep" adds: as steep as any, with a force that lifts the cube by some steps; N and degrees """
SEARCHED = {"plane": MAX_SIMULATED, "tumbling": 2000}
""" Jumps that the search for the best return may simulate """
SETS = METHODS | BEYOND
POLL_TIME = 1.0
""" Between two looks at the runs that another process is making [s] """
QUICK: dict[str, Any] = {
    "total_timesteps": 2000,
    "eval_every": 200,
    "n_samples": 500,
    "max_simulated": 1000,
    "dqn": {"learning_starts": 300},
}
""" Budgets of a quick study: its shape is that of a real one, its numbers say nothing """


@dataclass(frozen=True)
class Settings:
    """What all runs of a study share.

    Attributes
    ----------
    total_timesteps : int
        Jumps to train with.
    eval_every : int
        Training steps between two evaluations.
    n_samples : int
        Random jumps that the effect-based sets are made from.
    max_simulated : int, optional
        Jumps that the search for the best return may simulate: 20,000 in the plane, 2,000 in the tumbling world.
    world : {"tumbling", "plane"}
        Where sets are made and agents trained.
    restitution : float or None
        Of the plane's risers, see ``Staircase``.
    rocking, friction : float
        Of the tumbling world, see ``TumblingWorld``.
    as_published : bool
        The readings of the published code: time-outs are terminations, observations have 16 bits, an episode goes on on the
        top (see ``UpTheStairs``), and one set made from samples, that of seed 0, serves all seeds.
    dqn, sac : dict
        Settings of the algorithms in place of the published ones.
    quick : bool
        Whether the budgets are too small for the numbers to say anything.
    """

    total_timesteps: int = 30_000
    eval_every: int = EVAL_EVERY
    n_samples: int = 2000
    max_simulated: int | None = None
    world: str = "tumbling"
    restitution: float | None = None
    rocking: float = 1.0
    friction: float = 1.0
    as_published: bool = False
    dqn: dict[str, Any] = field(default_factory=dict)
    sac: dict[str, Any] = field(default_factory=dict)
    quick: bool = False

    def __post_init__(self) -> None:
        check_budget(self.total_timesteps, self.eval_every)
        self.make_world()  # checks it
        if self.max_simulated is None:
            object.__setattr__(self, "max_simulated", SEARCHED[self.world])
        for name in ("n_samples", "max_simulated"):
            whole_number(name, getattr(self, name), low=1)
        for algorithm in ("dqn", "sac"):
            check_settings(algorithm, getattr(self, algorithm))
        for name in ("quick", "as_published"):
            if not isinstance(getattr(self, name), bool):
                raise TypeError(f"{name} must be True or False, not {getattr(self, name)!r}.")

    def make_world(self, n_steps: int = 4) -> CubeWorld:
        """Make the world with four steps, where sets are made, or with the fifteen of the task."""
        staircase = (
            Staircase.fifteen(self.restitution) if n_steps == 15 else Staircase(n_steps, restitution=self.restitution)
        )
        return stair_world(self.world, staircase, rocking=self.rocking, friction=self.friction)

    @property
    def env_options(self) -> dict[str, Any]:
        """Options of the environment."""
        names = ("world", "restitution", "rocking", "friction", "as_published")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True)
class _Task:
    """One run: all that a worker needs to know."""

    method: str
    seed: int
    settings: Settings
    motions: Prototypes | None = None

    @property
    def name(self) -> str:
        return f"{self.method}-{self.seed}"


class Study:
    """A comparison of action sets on Up The Stairs: a DQN for each set and seed, and SAC without a set.

    Seed s gives independent children to sampling, to clustering and RGNG (and to random sets), and to training, so results depend
    neither on the order of the runs nor on where they are made. Each seed makes its own samples and sets.

    Parameters
    ----------
    methods : iterable of str
        Names from ``METHODS`` and ``BEYOND``. For sets of one's own: a file of motions as ``"name=motions.csv"`` among the names.
    seeds : iterable of int
        Different seeds, 0 or greater; six are the fewest for which results have intervals.
    total_timesteps : int
        Jumps to train with.
    out_dir : path-like
        Folder of the study. One that holds runs of the same study is gone on with; other methods and seeds may join it.
    known : StudyResults, optional
        Runs of the same study that are known from its tables, such as ``load_published_study("tumbling")``; they are not made again.
    **settings
        See ``Settings``.

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described, or the folder or the known results are of another study. Nothing is trained then.
    OSError
        If a file of motions cannot be read.

    Examples
    --------
    >>> study = Study(["effect", "uniform"], range(4), out_dir="study")  # doctest: +SKIP
    >>> results = study.run()  # doctest: +SKIP
    """

    def __init__(
        self,
        methods: Iterable[str] = tuple(METHODS),
        seeds: Iterable[int] = range(6),
        total_timesteps: int = 30_000,
        *,
        out_dir: str | PathLike[str] = "study",
        known: StudyResults | None = None,
        **settings: Any,
    ) -> None:
        self.settings = Settings(total_timesteps, **settings)
        given = [str(method) for method in _listed("methods", methods, "['effect', 'uniform']")]
        self.own = dict(_own_sets(given))
        self.methods = [name.partition("=")[0] for name in given]
        self.seeds = [whole_number("a seed", seed, low=0) for seed in _listed("seeds", seeds, "range(6)")]
        for what, values in (("methods", self.methods), ("seeds", self.seeds)):
            if not values or len(set(values)) < len(values):
                raise ValueError(f"{what} must be one or more, all different, not {values}.")
        self.out_dir = Path(out_dir)
        for name, motions in self.own.items():
            try:
                make_env(motions)
            except ValueError as error:
                raise ValueError(f"The motions {name!r} cannot be used: {error}") from None
        self._told: set[tuple[str, ...]] = set()
        _json(self._description())  # raises a TypeError for a setting that could not be written
        _check_same_study(self.out_dir, self._description())
        if not isinstance(known, StudyResults | None):
            raise TypeError(f"known must be StudyResults, not {type(known).__name__}.")
        self.known = known
        if known is not None:
            _refuse_other("known", known.description, self._description())
        self._known_runs = (
            set() if known is None else set(known.runs[["method", "seed"]].itertuples(index=False, name=None))
        )

    @classmethod
    def quick(
        cls,
        methods: Iterable[str] = tuple(METHODS),
        seeds: Iterable[int] = range(2),
        *,
        out_dir: str | PathLike[str] = "study-quick",
        **settings: Any,
    ) -> Study:
        """Make a study with small budgets: it shows the shape of a real one in minutes, and is marked in every output.

        The arguments are those of ``Study``; each of the budgets in ``QUICK`` can be given another value.
        """
        return cls(methods, seeds, out_dir=out_dir, **(QUICK | settings | {"quick": True}))

    def run(self, n_jobs: int = -1, *, progress: bool = True) -> StudyResults:
        """Make the runs that are not there yet, and return all of this study's.

        Parameters
        ----------
        n_jobs : int
            Processes, -1 for all cores. Inside ``joblib.parallel_config(backend="dask")`` the cluster's workers are used. Only this
            process writes, so workers need no common disk. A worker makes one run at a time, even if it has several threads.
        progress : bool
            Show a progress bar.

        Returns
        -------
        StudyResults

        Raises
        ------
        ValueError, TypeError
            If ``n_jobs`` is not a number of processes, or the folder has come to hold another study.
        OSError
            If a file cannot be written; the message names it, and all runs before are kept.
        RuntimeError
            If a run cannot be made; the message names it, and all runs before are kept.

        Warns
        -----
        UserWarning
            If a finished run is damaged; it is made anew. If it was made with other versions of the packages that results depend on,
            it is kept.
        """
        if whole_number("n_jobs", n_jobs) == 0:
            raise ValueError("n_jobs must be a number of processes, or -1 for all cores, not 0.")
        self.out_dir.mkdir(parents=True, exist_ok=True)
        with FileLock(self.out_dir / ".study.lock"):
            _check_same_study(self.out_dir, self._description())
            _join(self.out_dir, self._description())
        tasks = [
            _Task(method, seed, self.settings, self.own.get(method)) for seed in self.seeds for method in self.methods
        ]
        with tqdm(total=len(tasks), desc="study", unit="run", disable=not progress) as bar:
            while tasks := self._make(tasks, n_jobs, bar):
                time.sleep(POLL_TIME)  # another process is making the rest: it will be done, or give up
        return self.results()

    def _make(self, tasks: list[_Task], n_jobs: int, bar: tqdm) -> list[_Task]:
        """Make runs; return those that another process is making."""
        busy: list[_Task] = []
        locks: dict[str, FileLock] = {}

        def claimed() -> Iterator[_Task]:
            for task in tasks:
                lock = FileLock(self.out_dir / f".{task.name}.lock", thread_local=False)
                try:
                    lock.acquire(timeout=0)
                except Timeout:
                    busy.append(task)
                    continue
                locks[task.name] = lock
                if self._is_there(task):
                    locks.pop(task.name).release()
                    bar.update()
                else:
                    yield task

        # few are claimed ahead, so that a second process on the folder finds work
        parallel = joblib.Parallel(
            n_jobs=n_jobs, return_as="generator_unordered", pre_dispatch="n_jobs + 1", batch_size=1
        )
        try:
            with _quiet_loky(), _stopped_at_end(parallel(joblib.delayed(_perform)(task) for task in claimed())) as made:
                for name, files in made:
                    _store(self.out_dir / name, files)
                    locks.pop(name).release()
                    bar.update()
                    bar.set_postfix_str(name)
        finally:
            while locks:
                locks.popitem()[1].release()
        return busy

    def _is_there(self, task: _Task) -> bool:
        """Whether a run is finished and undamaged; a damaged one is reported and removed."""
        if (task.method, task.seed) in self._known_runs:
            return True
        folder = self.out_dir / task.name
        if not folder.exists():
            return False
        if (fault := damage(folder)) is None:
            self._compare_versions(folder)
            return True
        warnings.warn(f"The run {folder} is damaged ({fault}) and is made anew.", stacklevel=2)
        shutil.rmtree(folder)
        return False

    def _compare_versions(self, folder: Path) -> None:
        """Tell of a finished run that was made with other versions than those here, once for each combination of them."""
        there = json.loads((folder / "run.json").read_bytes())["versions"]
        differing = tuple(
            f"{package} is {there.get(package)} there and {here} here"
            for package, here in package_versions().items()
            if there.get(package) != here
        )
        if differing and differing not in self._told:
            self._told.add(differing)
            warnings.warn(
                f"The run {folder} was made with other versions: {'; '.join(differing)}. What is made now may not be comparable; name "
                "another folder to keep it apart.",
                stacklevel=2,
            )

    def results(self) -> StudyResults:
        """Read the finished runs of this study's methods and seeds."""
        folders = [self.out_dir / f"{method}-{seed}" for method in self.methods for seed in self.seeds]
        there = [folder for folder in folders if folder.exists()]
        if self.known is None:
            return StudyResults.from_runs(there, self._description())
        known = self.known.selected(self.methods, self.seeds)
        return known.joined(StudyResults.from_runs(there, self._description())) if there else known

    def _description(self) -> dict[str, Any]:
        own = {name: hashlib.sha256(motions.motions.tobytes()).hexdigest() for name, motions in self.own.items()}
        return {"settings": asdict(self.settings), "own": own}


@contextmanager
def _quiet_loky() -> Iterator[None]:
    """Let joblib replace a worker whose memory has grown, as it does when it first imports torch, without a warning.

    Where warnings are errors, it would end the thread that gives out the work, and the study would wait for ever.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "A worker stopped while some jobs were given")
        yield


@contextmanager
def _stopped_at_end(made: Generator) -> Iterator[Generator]:
    """Stop the workers after an error, too: else they would go on for what nobody will store."""
    try:
        yield made
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # joblib's, that tasks were cancelled
            made.close()


def _listed(name: str, values: Any, example: str) -> list[Any]:
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise TypeError(f"{name} must be several, such as {example}, not {values!r}.")
    return list(values)


def _own_sets(methods: Sequence[str]) -> Iterator[tuple[str, Prototypes]]:
    for method in methods:
        name, given, path = method.partition("=")
        if given:
            if name.lower() in SETS or not re.fullmatch(r"[A-Za-z][\w-]*", name):
                raise ValueError(
                    f"A set of your own needs a name of letters, digits, - and _, a letter first, that is not one of "
                    f"{', '.join(SETS)}; not {name!r}."
                )
            if not path:
                raise ValueError(f"{method!r} must name the set's file, such as {method + 'motions.csv'!r}.")
            yield name, Prototypes.from_csv(path)
        elif name not in SETS:
            raise ValueError(
                f"methods must be of {', '.join(SETS)}, or a file of motions as name=file.csv; not {method!r}."
            )


def _check_same_study(folder: Path, description: Mapping[str, Any]) -> None:
    """Refuse a folder that holds something else."""
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"out_dir must be a folder, but {folder} is a file.")
    path = folder / STUDY_FILE
    if not path.exists():
        if folder.exists() and any(not entry.name.startswith(".") for entry in folder.iterdir()):
            raise ValueError(f"out_dir must be new, empty, or hold a study, but {folder} holds other files.")
        return
    try:
        there = json.loads(path.read_bytes())
        settings, own = dict(there["settings"]), dict(there["own"])
    except (ValueError, KeyError, TypeError):
        raise ValueError(
            f"{path} is damaged: it does not say which study this is. Name another folder, or delete {folder}."
        ) from None
    _refuse_other(str(folder), {"settings": settings, "own": own}, description)


def _refuse_other(name: str, there: Mapping[str, Any], description: Mapping[str, Any]) -> None:
    """Refuse what is not of the same study."""
    settings, own, here = PLANE | there["settings"], there["own"], json.loads(_json(description))
    differing = [
        f"{name} is {settings.get(name)!r} there and {value!r} here"
        for name, value in here["settings"].items()
        if settings.get(name) != value
    ]
    differing += [
        f"the motions {name!r} differ" for name in own.keys() & here["own"].keys() if own[name] != here["own"][name]
    ]
    if differing:
        raise ValueError(f"{name} holds another study: {'; '.join(differing)}. Name another folder.")


def _join(folder: Path, description: Mapping[str, Any]) -> None:
    """Write which study this is, or add own sets to those that the folder already knows."""
    path = folder / STUDY_FILE
    before = path.read_bytes() if path.exists() else b""
    known = json.loads(before)["own"] if before else {}
    content = _json({**description, "own": known | description["own"]})
    if content != before:
        write_bytes(path, content)


def _store(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write the folder of a run, whole or not at all."""
    part = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(part, ignore_errors=True)  # of a process that was killed
    sums = "".join(f"{hashlib.sha256(content).hexdigest()}  {name}\n" for name, content in files.items())
    try:
        part.mkdir()
        for name, content in {**files, CHECKSUMS: sums.encode()}.items():
            write_bytes(part / name, content)
        part.rename(folder)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise


# A worker's part: from a task to the files of a run, without touching the disk.


_ALONE = threading.Lock()


def _perform(task: _Task) -> tuple[str, dict[str, bytes]]:
    """Make one run; return its name and its files."""
    # torch has one random generator for all threads of a process; and what a run does itself with joblib must not be spread as well,
    # because a Dask worker begins another run while it waits for that
    with _ALONE, joblib.parallel_config("sequential"), threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of odd classes: run.json has the counts
        try:
            return task.name, _files(task)
        except (OSError, MemoryError):
            raise
        except Exception as error:
            raise RuntimeError(f"The run {task.name} could not be made: {error}") from error


def _files(task: _Task) -> dict[str, bytes]:
    settings = task.settings
    children = dict(zip(("sampling", "prototypes", "training", "episodes"), _children(task.seed), strict=True))
    began = time.perf_counter()
    motions = task.motions or motion_set(task.method, task.seed, settings)
    prepared = time.perf_counter()
    algorithm = "dqn" if motions else "sac"
    training = train(
        algorithm,
        motions,
        children["training"],
        settings.total_timesteps,
        eval_every=settings.eval_every,
        env_options=settings.env_options,
        progress=False,
        **getattr(settings, algorithm),
    )
    trained = time.perf_counter()
    plan = _plan(motions, settings) if motions else None
    planned = time.perf_counter()
    run = {
        "method": task.method,
        "seed": task.seed,
        "algorithm": algorithm,
        "score": training.score(),
        "actions": len(motions) if motions else None,
        "set": motions.settings if motions else None,
        "samples": settings.n_samples if task.method in _WITH_CLASSES else 0,
        "parameters": count_parameters(training.model),
        "plan": _plan_summary(plan) if plan else None,
        "seconds": {"set": prepared - began, "training": trained - prepared, "planning": planned - trained},
        "children": {
            name: {"entropy": child.entropy, "spawn_key": child.spawn_key} for name, child in children.items()
        },
        "settings": asdict(settings),
        "versions": training.versions,
    }
    episode = _last_episodes(training, motions, settings, children["episodes"])
    files = {"evaluations.csv": _csv(training.evaluations), "episode.csv": _csv(episode)}
    if motions:
        files["motions.csv"] = _csv(motions.to_frame())
    return files | {"run.json": _json(run)}  # last: checksums that were cut off lack it


_WITH_CLASSES = ("effect", "effect-reliable", "fixed", "effect-plus-steep", "along-stairs")


def _children(seed: int) -> list[np.random.SeedSequence]:
    """Return the seeds of sampling, of clustering, RGNG and random sets, of training, and of the last episodes."""
    return np.random.SeedSequence(seed).spawn(4)


def motion_set(method: str, seed: int, settings: Settings | None = None) -> Prototypes | None:
    """Make the motions of a method of ``METHODS`` or ``BEYOND`` for a study's seed; None for SAC, which has none.

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described, or so few samples end on the map that there are no classes to find.
    """
    one_of("method", method, SETS)
    whole_number("seed", seed, low=0)
    settings = settings or Settings()
    world = settings.make_world()
    sampled = 0 if settings.as_published else seed  # as published, one set made from samples serves all seeds
    for_sampling, for_prototypes, *_ = _children(sampled)
    for_random = _children(seed)[1]

    def effect(**options: Any) -> Prototypes:
        return effect_prototypes(_classes(sampled, _key(settings)), for_prototypes, world=world, **options)

    def plus_steep() -> Prototypes:
        prototypes = effect()
        return Prototypes(np.vstack([prototypes.motions, STEEP]), method=method, settings=prototypes.settings)

    def without_corners() -> Prototypes:
        grid = uniform_prototypes(world).motions
        corner = (np.isclose(grid, world.motion_low) | np.isclose(grid, world.motion_high)).all(axis=1)
        return Prototypes(grid[~corner], method=method)

    recipes = {
        "effect": lambda: effect(),
        "effect-reliable": lambda: effect(refine="core"),
        "fixed": lambda: effect(fixed=FIXED),
        "uniform": lambda: uniform_prototypes(world),
        "random": lambda: random_prototypes(world, seed=for_random),
        "uniform-matched": lambda: uniform_prototypes(world, n=max(len(effect()), 4)),
        "random-matched": lambda: random_prototypes(world, n=len(effect()), seed=for_random),
        "sac": lambda: None,
        "uniform-shifted": lambda: uniform_prototypes(world, seed=for_random),
        "uniform-no-corners": without_corners,
        "effect-plus-steep": plus_steep,
        "along-stairs": lambda: along_stairs_prototypes(world, settings.n_samples, seed=for_sampling),
    }
    return recipes[method]()


def _key(settings: Settings) -> tuple[Any, ...]:
    """Return what the samples of a study depend on, besides the seed."""
    return settings.n_samples, settings.world, settings.restitution, settings.rocking, settings.friction


@lru_cache(maxsize=4)
def _classes(seed: int, key: tuple[Any, ...]) -> EffectClasses:
    """Sample and classify; several sets of a seed are made from the same classes."""
    n_samples, world, restitution, rocking, friction = key
    for_sampling, for_prototypes, *_ = _children(seed)
    where = stair_world(world, Staircase(restitution=restitution), rocking=rocking, friction=friction)
    samples = sample_motions(where, n_samples, for_sampling, progress=False)
    return EffectClasses.from_samples(samples, seed=for_prototypes)


def _plan(motions: Prototypes, settings: Settings) -> Plan:
    return _plan_of(tuple(map(tuple, motions.motions.tolist())), settings.max_simulated, _key(settings)[1:])


@lru_cache(maxsize=4)
def _plan_of(motions: tuple[tuple[float, ...], ...], max_simulated: int, key: tuple[Any, ...]) -> Plan:
    """Search once for sets that are the same for every seed."""
    world, restitution, rocking, friction = key
    where = stair_world(world, Staircase.fifteen(restitution), rocking=rocking, friction=friction)
    return best_return(where, np.array(motions), max_simulated=max_simulated, progress=False)


def _plan_summary(plan: Plan) -> dict[str, Any]:
    """Return what the search found and what it covered."""
    names = ("value", "bound", "proved", "exhausted", "steps_climbed", "reached_top", "expanded", "merged", "simulated")
    return {name: getattr(plan, name) for name in names} | {"jumps": len(plan), "motions": plan.motions.tolist()}


def _last_episodes(
    training: Training, motions: Prototypes | None, settings: Settings, seed: np.random.SeedSequence
) -> pd.DataFrame:
    """Play the trained agent's greedy episodes: a row for each jump, with the motion, where it ended, and its reward.

    There are as many as in an evaluation where the world is random, else one.

    "action" is the row number of the motion in the set, counted from 0, and -1 for SAC.
    """
    env = make_env(motions, **settings.env_options)
    env.reset(seed=int(seed.generate_state(1)[0]))
    world = env.unwrapped.world  # type: ignore[attr-defined]
    rows: list[tuple[float, ...]] = []
    for episode in range(EVAL_EPISODES if world.random else 1):
        for jump, (action, reward, info) in enumerate(greedy_steps(training.model, env), start=1):
            magnitude, angle = motions.motions[action] if motions else action
            x, y, z, *quaternion, _ = world.state.tolist()
            place = [round(value, 6) for value in (x, y, z)]
            chosen = int(action) if motions else -1
            motion, yaw = (float(magnitude), float(angle)), round(yaw_of(*quaternion), 3)
            rows.append((episode, jump, chosen, *motion, *place, yaw, info["steps"], round(reward, 6)))
    columns = ["episode", "jump", "action", "magnitude", "angle", "x", "y", "z", "yaw", "steps", "reward"]
    return pd.DataFrame(rows, columns=columns)


def _json(value: Any) -> bytes:
    return (json.dumps(value, indent=1, default=_plain) + "\n").encode()


def _plain(value: Any) -> Any:
    """Turn NumPy's numbers into Python's for JSON."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} cannot be written as JSON.")


def _csv(table: pd.DataFrame) -> bytes:
    text = io.StringIO()
    table.to_csv(text, index=False, lineterminator="\n")
    return text.getvalue().encode()
