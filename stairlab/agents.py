"""The agents of the paper (section 4): DQN with a set of motions, SAC on the continuous motion space (Stable-Baselines3)."""

from __future__ import annotations

import json
import time
import warnings
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib.metadata import version
from inspect import signature
from os import PathLike
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd
import torch
from stable_baselines3 import DQN, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from stairlab._validation import Seed, finite_number, one_of, seed_sequence, whole_number
from stairlab.envs import DiscreteMotions
from stairlab.prototypes import Prototypes

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {"dqn": DQN, "sac": SAC}
PUBLISHED_SETTINGS: dict[str, dict[str, Any]] = {"dqn": {"learning_starts": 3000}, "sac": {}}
""" What the published training changes of Stable-Baselines3's defaults """
EVAL_EVERY = 500
""" Training steps between two evaluations """
EVAL_EPISODES = 5
""" Greedy episodes of an evaluation """
PACKAGES = ("stairlab", "gymnasium", "stable-baselines3", "torch", "numpy", "pymunk")
""" What results depend on """
SET_BY_TRAIN = ("policy", "env", "seed", "device", "_init_setup_model")
""" Parameters of the algorithms that are no settings """


@dataclass(frozen=True, eq=False)
class Training:
    """A finished training. Made by ``train``.

    Attributes
    ----------
    evaluations : pandas.DataFrame
        A row for each greedy episode: "step" of the training after which it was played, "episode" (from 0), "return" (sum of
        rewards), "length" (jumps), "climbed" (steps above the ground at the end; for the stairs).
    settings : dict
        Method, seed, steps, motions and everything else that was set.
    versions : dict of str to str
        Versions of the packages that results depend on.
    wall_time : float
        Time that training and evaluations took [s].
    model : stable_baselines3 algorithm
        The trained agent.
    """

    evaluations: pd.DataFrame
    settings: dict[str, Any]
    versions: dict[str, str]
    wall_time: float
    model: BaseAlgorithm = field(repr=False)

    def score(self) -> float:
        """Return the mean greedy return of the last five evaluations (steps 28,000 to 30,000 at paper scale)."""
        means = self.evaluations.groupby("step")["return"].mean()
        return float(means.iloc[-5:].mean())


def make_env(motions: Prototypes | np.ndarray | None = None, **options: Any) -> gym.Env:
    """Make Up The Stairs with its time limit, and with a set of motions as actions where one is given.

    Parameters
    ----------
    motions : Prototypes or array-like of shape (n_motions, 2), optional
        Magnitude [N] and angle [deg] of each action; the continuous motion space by default.
    **options
        Of the environment, such as ``world="tumbling"``, ``n_steps`` or ``actuation_noise``. Without a ``world`` it is the plane.

    Returns
    -------
    gymnasium.Env
    """
    env = gym.make("stairlab/UpTheStairs-v1", **{"world": "plane"} | options)
    return env if motions is None else DiscreteMotions(env, motions)


def train(
    method: str,
    motions: Prototypes | np.ndarray | None = None,
    seed: Seed = 0,
    total_timesteps: int = 30_000,
    *,
    eval_every: int = EVAL_EVERY,
    eval_episodes: int = EVAL_EPISODES,
    env_options: dict[str, Any] | None = None,
    progress: bool = True,
    watch: Callable[[BaseAlgorithm, pd.DataFrame], Any] | None = None,
    **settings: Any,
) -> Training:
    """Train an agent to climb the stairs, and evaluate it on the way.

    Departures from the published training: an episode is truncated after 50 jumps, not 51; it ends when the cube rests on the top; and
    where nothing is random, the five greedy episodes of an evaluation are one and the same, so one is played.

    Parameters
    ----------
    method : {"dqn", "sac"}
        DQN needs ``motions``; SAC acts on the continuous motion space and must not get any.
    motions : Prototypes or array-like of shape (n_motions, 2), optional
        Magnitude [N] and angle [deg] of each action.
    seed : int or numpy.random.SeedSequence
        Its children seed the agent, the training environment and the evaluations.
    total_timesteps : int
        Jumps to train with.
    eval_every : int
        Training steps between two evaluations with the greedy policy, on an environment of its own; they do not change the training.
        At most ``total_timesteps``.
    eval_episodes : int
        Episodes of an evaluation, where there is randomness (rocking, noise, drift).
    env_options : dict, optional
        Of the environment, such as ``{"n_steps": 4}``.
    progress : bool
        Show a progress bar with the current return.
    watch : callable, optional
        Called before the first jump and after each evaluation, with the agent as it is then and the evaluations so far. It must not
        change the agent.
    **settings
        Of the algorithm, in place of the published ones: Stable-Baselines3's defaults, and ``learning_starts=3000`` for DQN.

    Returns
    -------
    Training

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described; nothing is trained then.
    """
    check_settings(one_of("method", method, ALGORITHMS), settings)
    if (motions is None) == (method == "dqn"):
        raise ValueError(
            f"motions must be given for 'dqn' and not for 'sac', but the method is {method!r} and motions are {motions!r}."
        )
    check_budget(total_timesteps, eval_every)
    eval_episodes = whole_number("eval_episodes", eval_episodes, low=1)
    if not isinstance(env_options, Mapping | None):
        raise TypeError(f"env_options must be a dict, such as {{'n_steps': 4}}, not {env_options!r}.")
    if not (watch is None or callable(watch)):
        raise TypeError(f"watch must be a function of the agent and its evaluations, not {watch!r}.")
    options = dict(env_options or {})
    for_agent, for_env, for_evaluation = (int(child.generate_state(1)[0]) for child in seed_sequence(seed).spawn(3))
    env, eval_env = make_env(motions, **options), make_env(motions, **options)
    env.reset(seed=for_env)
    settings = PUBLISHED_SETTINGS[method] | settings
    evaluation = _Evaluation(
        eval_env,
        eval_every,
        eval_episodes if eval_env.unwrapped.random else 1,  # type: ignore[attr-defined]
        for_evaluation,
        total_timesteps if progress else 0,
        watch,
    )
    with _one_thread():
        model = ALGORITHMS[method]("MlpPolicy", env, seed=for_agent, device="cpu", **settings)  # type: ignore[call-arg]
        began = time.perf_counter()
        model.learn(total_timesteps, callback=evaluation)
        wall_time = time.perf_counter() - began
    chosen = None if motions is None else np.asarray(getattr(motions, "motions", motions), dtype=float).tolist()
    return Training(
        evaluation.table(),
        {"method": method, "seed": str(seed), "total_timesteps": total_timesteps, "motions": chosen}
        | {"eval_every": eval_every, "env": options, **settings},
        package_versions(),
        wall_time,
        model,
    )


def check_budget(total_timesteps: int, eval_every: int) -> None:
    """Refuse a training without an evaluation.

    Raises
    ------
    ValueError, TypeError
        If one is not a whole number from 1 on, or ``eval_every`` is greater than ``total_timesteps``.
    """
    whole_number("total_timesteps", total_timesteps, low=1)
    if whole_number("eval_every", eval_every, low=1) > total_timesteps:
        raise ValueError(
            f"eval_every must be at most total_timesteps ({total_timesteps}), so that there is an evaluation, not {eval_every}."
        )


def check_settings(method: str, settings: dict[str, Any]) -> None:
    """Refuse settings that an algorithm does not have, or of another type than it takes.

    Raises
    ------
    ValueError
        If there is no such setting.
    TypeError
        If the settings are no dict, or one that must be a number, or True or False, is not.
    """
    if not isinstance(settings, dict):
        raise TypeError(f"{method} must be a dict of settings, such as {{'gamma': 0.9}}, not {settings!r}.")
    known = {name: of for name, of in signature(ALGORITHMS[method]).parameters.items() if name not in SET_BY_TRAIN}
    for name, value in settings.items():
        if name not in known:
            near = get_close_matches(str(name), known, n=1)
            help_ = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}."
            raise ValueError(f"{method} has no setting {name!r}; {help_}")
        _check_type(name, value, known[name].annotation)


def _check_type(name: str, value: Any, kind: Any) -> None:
    if kind is int:
        whole_number(name, value)
    elif kind is float or (name == "learning_rate" and not callable(value)):
        finite_number(name, value)
    elif kind is bool and not isinstance(value, bool):
        raise TypeError(f"{name} must be True or False, not {value!r}.")


def package_versions() -> dict[str, str]:
    """Return the versions of the packages that results depend on."""
    return {name: version(name) for name in PACKAGES}


@contextmanager
def _one_thread() -> Iterator[None]:
    """One torch thread: for networks this small more are slower, and results do not depend on the number of cores."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


class _Evaluation(BaseCallback):
    """Plays greedy episodes every so often, and moves the progress bar."""

    def __init__(
        self,
        env: gym.Env,
        every: int,
        episodes: int,
        seed: int,
        total: int,
        watch: Callable[[BaseAlgorithm, pd.DataFrame], Any] | None,
    ) -> None:
        super().__init__()
        self.env = env
        self.every = every
        self.episodes = episodes
        self.env.reset(seed=seed)
        self.bar = tqdm(total=total, desc="training", unit="jump", disable=not total, leave=False)
        self.watch = watch
        self.rows: list[dict[str, Any]] = []

    def table(self) -> pd.DataFrame:
        return pd.DataFrame(self.rows, columns=["step", "episode", "return", "length", "climbed"])

    def _show(self) -> None:
        if self.watch is not None:
            self.watch(self.model, self.table())

    def _on_training_start(self) -> None:
        self._show()

    def _on_step(self) -> bool:
        self.bar.update()
        if self.num_timesteps % self.every == 0:
            for episode in range(self.episodes):
                played = play_episode(self.model, self.env)
                self.rows.append({"step": self.num_timesteps, "episode": episode, **played})
            self.bar.set_postfix_str(f"greedy return {self.rows[-1]['return']:.1f}")
            self._show()
        return True

    def _on_training_end(self) -> None:
        self.bar.close()


def play_episode(model: BaseAlgorithm, env: gym.Env) -> dict[str, float]:
    """Play one episode with the greedy policy.

    Returns
    -------
    dict
        "return" (sum of rewards), "length" (jumps) and "climbed" (steps above the ground at the end; NaN where the environment
        does not say).
    """
    total, length, climbed = 0.0, 0, float("nan")
    for _, reward, info in greedy_steps(model, env):
        total, length, climbed = total + reward, length + 1, info.get("steps", float("nan"))
    return {"return": total, "length": length, "climbed": climbed}


def greedy_steps(model: BaseAlgorithm, env: gym.Env) -> Iterator[tuple[np.ndarray, float, dict[str, Any]]]:
    """Play one episode with the greedy policy, step by step; after each, the environment is as the step left it.

    Yields
    ------
    action : ndarray
        What the agent chose: the row number of a motion, shape (), or an action of shape (2,).
    reward : float
        What it earned.
    info : dict
        What the environment tells.
    """
    observation, _ = env.reset()
    over = False
    while not over:
        action, _ = model.predict(observation, deterministic=True)
        observation, reward, terminated, truncated, info = env.step(action)
        over = terminated or truncated
        yield action, float(reward), info


def count_parameters(model: BaseAlgorithm) -> dict[str, int]:
    """Count the parameters of an agent's networks, honestly and as published.

    The paper compares 475,146 parameters of SAC with 5,520 of DQN (16 actions), 85 times as many. The first number is actor and
    critics and the critics' targets, with the critics counted twice; the second is one of DQN's two networks.

    Returns
    -------
    dict of str to int
        "deciding" (the network that chooses actions: q-network or actor), "trained" (all that are trained), "with targets" (and
        their slowly following copies), and "as published".
    """
    if isinstance(model, DQN):
        deciding = trained = _size(model.q_net)
        targets = _size(model.q_net_target)
        published = deciding
    elif isinstance(model, SAC):
        deciding, critics, targets = _size(model.actor), _size(model.critic), _size(model.critic_target)
        trained = deciding + critics
        published = deciding + 2 * critics + targets
    else:
        raise TypeError(f"model must be a DQN or a SAC of Stable-Baselines3, not {type(model).__name__}.")
    return {"deciding": deciding, "trained": trained, "with targets": trained + targets, "as published": published}


def _size(network: torch.nn.Module) -> int:
    return sum(parameter.numel() for parameter in network.parameters())


def save_agent(model: BaseAlgorithm, path: str | PathLike[str]) -> None:
    """Save an agent in Stable-Baselines3's own format; the file appears whole or not at all."""
    path = Path(path)
    temporary = path.with_name(f".{path.name}.part.zip")
    try:
        model.save(temporary)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def load_agent(path: str | PathLike[str]) -> BaseAlgorithm:
    """Load an agent that ``save_agent`` has saved.

    Warns
    -----
    UserWarning
        Always: such a file can run any code when it is loaded. Load only what you have saved yourself.

    Raises
    ------
    ValueError
        If it is not such a file.
    OSError
        If it cannot be read.
    """
    warnings.warn(f"{path} can run any code when it is loaded: load only agents from people you trust.", stacklevel=2)
    try:
        with zipfile.ZipFile(path) as archive:
            data = json.loads(archive.read("data"))
    except (zipfile.BadZipFile, KeyError, json.JSONDecodeError):
        raise ValueError(f"{path} must be an agent saved by Stable-Baselines3, and is not.") from None
    algorithm = ALGORITHMS["sac" if "ent_coef" in data else "dqn"]
    return algorithm.load(Path(path), device="cpu")


def play(
    model: BaseAlgorithm,
    path: str | PathLike[str],
    motions: Prototypes | np.ndarray | None = None,
    *,
    fps: float = 2,
    **options: Any,
) -> dict[str, float]:
    """Play one greedy episode and write it as a film, one frame a jump.

    Parameters
    ----------
    model : stable_baselines3 algorithm
        The agent.
    path : path-like
        The film, ending in .gif or .mp4.
    motions : Prototypes or array-like of shape (n_motions, 2), optional
        The motions that the agent was trained with (DQN).
    fps : float
        Frames per second.
    **options
        Of the environment.

    Returns
    -------
    dict
        As ``play_episode``.

    Raises
    ------
    ValueError
        If the path does not end in .gif or .mp4, or ``fps`` is not positive.
    """
    path = Path(path)
    one_of("the ending of path", path.suffix, (".gif", ".mp4"))
    film = _Film(make_env(motions, render_mode="rgb_array", **options))
    played = play_episode(model, film)
    write = _write_gif if path.suffix == ".gif" else _write_mp4
    temporary = path.with_name(f".part.{path.name}")
    try:
        write(film.frames, temporary, finite_number("fps", fps, above=0))
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return played


class _Film(gym.Wrapper):
    """Keeps a frame of the start and of every step."""

    def __init__(self, env: gym.Env) -> None:
        super().__init__(env)
        self.frames: list[np.ndarray] = []

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        result = self.env.reset(**options)
        self.frames = [self.env.render()]  # type: ignore[list-item]
        return result

    def step(self, action: Any) -> Any:
        result = self.env.step(action)
        self.frames.append(self.env.render())  # type: ignore[arg-type]
        return result


def _write_gif(frames: list[np.ndarray], path: Path, fps: float) -> None:
    from PIL import Image

    first, *rest = (Image.fromarray(frame) for frame in frames)
    first.save(path, save_all=True, append_images=rest, duration=round(1000 / fps), loop=0)


def _write_mp4(frames: list[np.ndarray], path: Path, fps: float) -> None:
    import imageio_ffmpeg

    height, width, _ = frames[0].shape
    writer = imageio_ffmpeg.write_frames(str(path), (width, height), fps=fps, macro_block_size=4)
    writer.send(None)
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()
