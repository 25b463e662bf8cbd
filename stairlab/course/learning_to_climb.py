"""Lesson 09, learning to climb: pictures of the small climb and its table, agents watched while they learn, and their pictures.

torch and Stable-Baselines3 are imported by the functions that need them: the table and its widget work without.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure

from stairlab._validation import Seed
from stairlab.course.small_climb import DISCOUNT, EPISODES, Learned, SmallClimb, play, q_learning
from stairlab.drawing import COLORS, FAINT, GRID, INK, OFF_MAP, PATH, new_figure
from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.plots import MARKERS, draw_cube, draw_stairs, pose
from stairlab.prototypes import Prototypes
from stairlab.results import StudyResults
from stairlab.study_plots import method_style
from stairlab.world import START_Y

if TYPE_CHECKING:
    import torch
    from stable_baselines3 import DQN, SAC
    from stable_baselines3.common.base_class import BaseAlgorithm

    from stairlab.agents import Training

LEARNING_RATES = (0.1, 0.3, 1.0)
EXPLORATIONS = (0.0, 0.1, 0.3, 0.5)
VISIBLE = (2.45, 1.45)
""" How far along and how high the picture of a table shows the stairs [m] """
SCALE = 2.0
""" ... and at what size [inches / m] """
VALUES_EVERY = 0.01
""" Distance between places at which a network's values are shown [m] """
STILL = 0.001
""" A cube that moves by less hops on the spot [m] """
MOST_NEURONS = 9
""" A layer is drawn with so many neurons, at most """
SMALLEST_GAP = 0.002
""" Values are shown for cubes that stand at least so far from both ends of their tread [m] """


# Pictures of the small climb


def draw_motions(climb: SmallClimb | None = None) -> Figure:
    """Draw the small climb, and what each motion does from the start pose."""
    climb = climb or SmallClimb()
    jumps = {name: _flight(climb, None, name) for name in climb.motions}
    words = [
        f"{name} gains {round(jump.dz / climb.staircase.rise)} and ends at y = {jump.end[1]:.2f} m"
        for name, jump in jumps.items()
    ]
    figure, ax = new_figure(f"Three steps, and four motions from the start pose: {'; '.join(words)}.", size=(6.4, 4.2))
    draw_stairs(ax, climb.staircase, 1.75, 2.0)
    draw_cube(ax, *pose(climb.world.start))
    for number, (name, jump) in enumerate(jumps.items(), 1):
        label = f"{name}: {jump.magnitude:g} N at {jump.angle:g}°"
        ax.plot(jump.trajectory.y, jump.trajectory.z, color=COLORS[number], linewidth=1.6, zorder=3, label=label)
        draw_cube(ax, *pose(jump.end), facecolor=COLORS[number], alpha=0.75)
    ax.set_xlim(-0.05, 2.3)
    ax.legend(frameon=False, loc="upper left", fontsize=9)
    return figure


def _flight(climb: SmallClimb, state: np.ndarray | None, name: str) -> Any:
    """Return a jump with its path; from the start pose by default."""
    climb.world.reset(state)
    return climb.world.jump(*climb.motions[name], trajectory=True)


def draw_table(table: np.ndarray, climb: SmallClimb | None = None, words: str = "") -> Figure:
    """Draw a table under its stairs: a row for each motion, a column for each cell, and above it the greedy episode.

    Parameters
    ----------
    table : ndarray of shape (n_cells, n_motions)
        The values, each the discounted return that is expected.
    climb : SmallClimb, optional
        What it is a table of.
    words : str
        What stands above.

    Returns
    -------
    matplotlib Figure
    """
    climb = climb or SmallClimb()
    episode, value = _greedy_episode(climb, table)
    known = int((table != 0).sum())
    end = f"step {round((episode[-1].end[2] - CUBE_EDGE / 2) / climb.staircase.rise)}"
    figure, (above, below) = new_figure(
        f"{words + ': t' if words else 'T'}he table of values, {known} of {table[:-1].size} entries not 0, under the stairs. By its "
        f"best motions the cube ends on {end} with a return of {value:.3g}.",
        panels=2,
        size=(0.65 + VISIBLE[0] * SCALE + 0.1, 0.95 + VISIBLE[1] * SCALE + 1.35),
        columns=1,
    )
    figure.set_layout_engine("none")
    width, height = figure.get_size_inches()
    left, across = 0.65 / width, VISIBLE[0] * SCALE / width
    above.set_position((left, (0.55 + 1.25) / height, across, VISIBLE[1] * SCALE / height))
    below.set_position((left, 0.5 / height, across, 1.15 / height))
    _draw_greedy(above, climb, episode)
    above.set_title(
        f"{words}{', ' if words else ''}greedy return {value:.3g} of {climb.staircase.n_steps}", fontsize=10, loc="left"
    )
    _draw_entries(figure, below, climb, table)
    return figure


def _greedy_episode(climb: SmallClimb, table: np.ndarray) -> tuple[list[Any], float]:
    """Return the jumps of the greedy episode, with their paths (hops on the spot are left out), and its return."""
    names, value, state = list(climb.motions), 0.0, climb.world.start
    jumps: list[Any] = []
    for _, motion, reward, _, _ in play(climb, lambda cell: int(table[cell].argmax())):
        value += reward
        if not jumps or np.abs(climb.state[1:3] - state[1:3]).sum() > STILL:
            jumps.append(_flight(climb, state, names[motion]))
        state = climb.state
    return jumps, value


def _draw_greedy(ax: Axes, climb: SmallClimb, episode: Sequence[Any]) -> None:
    draw_stairs(ax, climb.staircase, VISIBLE[1] - 0.05, VISIBLE[0])
    for jump in episode:
        ax.plot(jump.trajectory.y, jump.trajectory.z, color=PATH, linewidth=1.4, zorder=3)
        draw_cube(ax, *pose(jump.start), facecolor="none", edgecolor=FAINT)
    draw_cube(ax, *pose(episode[-1].end))
    ax.set(xlim=(0, VISIBLE[0]), ylim=(-0.05, VISIBLE[1] - 0.05), xlabel="", aspect="auto")
    ax.tick_params(labelbottom=False)


def _draw_entries(figure: Figure, ax: Axes, climb: SmallClimb, table: np.ndarray) -> None:
    shown = np.ma.masked_equal(table[:-1].T, 0)
    edges = climb.cell * np.arange(climb.n_cells)
    rows = np.arange(len(climb.motions) + 1) - 0.5
    mesh = ax.pcolormesh(edges, rows, shown, cmap=_values_colors(), vmin=0, vmax=2.75, edgecolor=GRID, linewidth=0.3)
    for cell, row in enumerate(table[:-1]):
        if row.max() > 0:
            ax.plot((cell + 0.5) * climb.cell, row.argmax(), "^", color="white", markeredgecolor=INK, markersize=5)
    ax.set(
        xlim=(0, VISIBLE[0]), ylim=(len(climb.motions) - 0.5, -0.5), xlabel="y [m]", yticks=range(len(climb.motions))
    )
    ax.set_yticklabels(list(climb.motions))
    bar = figure.colorbar(mesh, cax=ax.inset_axes((0.64, 0.5, 0.3, 0.16)), orientation="horizontal")
    bar.set_label("value (white: 0)", fontsize=8)
    bar.ax.tick_params(labelsize=8)


def _values_colors() -> Colormap:
    """Light to dark blue and green: told apart with any colour vision, and in grey."""
    from matplotlib import colormaps

    return ListedColormap(colormaps["viridis_r"](np.linspace(0.03, 1, 128)))


@lru_cache(maxsize=1)
def _widget_climb() -> SmallClimb:
    return SmallClimb()


@lru_cache(maxsize=64)
def _widget_learned(learning_rate: float, exploration: float) -> Learned:
    return q_learning(_widget_climb(), EPISODES[-1], learning_rate, exploration)


def draw_learning(episodes: int = 10, learning_rate: float = 0.3, exploration: float = 0.3) -> Figure:
    """Draw the table that Q-learning has after so many ``EPISODES``, seed 0."""
    learned = _widget_learned(learning_rate, exploration)
    words = f"{episodes} episode{'s' if episodes > 1 else ''}, {learned.jumps[episodes]:,} jumps"
    return draw_table(learned.tables[episodes], _widget_climb(), words)


# Agents that are watched while they learn


def train_live(
    method: str,
    motions: Prototypes | np.ndarray | None = None,
    total_timesteps: int = 6000,
    seed: Seed = 0,
    *,
    name: str = "",
    beside: Mapping[str, pd.DataFrame] | None = None,
    watch: Callable[[Any], Any] | None = None,
    **options: Any,
) -> tuple[Training, dict[int, Any]]:
    """Train an agent as ``stairlab.train`` does, to the bit, and draw its curve while it learns.

    Parameters
    ----------
    method : {"dqn", "sac"}
        DQN needs ``motions``.
    motions : Prototypes or array-like of shape (n_motions, 2), optional
        Magnitude [N] and angle [deg] of each action.
    total_timesteps : int
        Jumps to train with.
    seed : int or numpy.random.SeedSequence
        As for ``train``.
    name : str
        What the curve is called; the method by default.
    beside : mapping of str to pandas.DataFrame, optional
        Evaluations of other agents, drawn beside.
    watch : callable, optional
        Gets the agent before the first jump and at each evaluation.
    **options
        Further arguments of ``train``.

    Returns
    -------
    training : Training
        As ``train`` returns it.
    seen : dict of int to object
        What ``watch`` returned before the first jump (0) and at each evaluation.
    """
    from stairlab.agents import train

    seen: dict[int, Any] = {}
    picture = _LivePicture()

    def look(model: BaseAlgorithm, evaluations: pd.DataFrame) -> None:
        if watch is not None:
            seen[model.num_timesteps] = watch(model)
        picture.show(draw_curves({**(beside or {}), name or method: evaluations}, total_timesteps))

    return train(method, motions, seed, total_timesteps, progress=False, watch=look, **options), seen


class _LivePicture:
    """A picture of a notebook that is replaced by the next one; the last one stays. Elsewhere nothing is shown."""

    def __init__(self) -> None:
        self.handle: Any = None

    def show(self, figure: Figure) -> None:
        """Show a picture in the place of the one before."""
        try:
            from IPython import get_ipython
            from IPython.display import display
        except ImportError:
            return
        if get_ipython() is None:
            return
        if self.handle is None:
            self.handle = display(figure, display_id=True)
        else:
            self.handle.update(figure)


def draw_curves(curves: Mapping[str, pd.DataFrame], total_timesteps: int) -> Figure:
    """Draw the greedy returns of some agents against the jumps of their training so far."""
    ends = [f"{name}: {round(rows['return'].iloc[-1], 1):g}" for name, rows in curves.items() if len(rows)]
    figure, ax = new_figure(
        f"Greedy return on fifteen steps against jumps of training, up to {total_timesteps:,}; at the end "
        f"{', '.join(ends) or 'nothing yet'}.",
        size=(6.4, 3.2),
    )
    for place, (name, rows) in enumerate(curves.items()):
        ax.plot(rows["step"], rows["return"], color=COLORS[1 + place], marker=MARKERS[place], markersize=5, label=name)
    ax.axhline(15, color=FAINT, linestyle=":", linewidth=1)
    ax.set(xlim=(0, total_timesteps * 1.02), ylim=(-2, 16), xlabel="training [jumps]", ylabel="greedy return [reward]")
    ax.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(0, 0.7))
    return figure


def values_along(model: DQN, network: torch.nn.Module | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return what an agent thinks a place is worth: its largest value for an upright cube, along the fifteen steps.

    Parameters
    ----------
    model : stable_baselines3.DQN
        The agent.
    network : torch module, optional
        Which of its networks; the q-network by default.

    Returns
    -------
    y, values : ndarray of shape (n,)
        Places [m], and the largest value at each; NaN between two treads.
    """
    import torch

    stairs = Staircase.fifteen()
    network = model.q_net if network is None else network
    places = []
    for begin, end, height in [(0.0, stairs.first_riser, 0.0), *stairs.treads[:-1].tolist()]:
        margin = CUBE_EDGE / 2 + SMALLEST_GAP
        y = np.arange(begin + margin, end - margin + 1e-9, VALUES_EVERY)
        places.append(np.column_stack([0 * y, y, 0 * y + height + CUBE_EDGE / 2, end - y]))
        places.append(np.array([[0, end, np.nan, 0]]))
    seen = np.concatenate(places)
    with torch.no_grad():
        values = network(torch.as_tensor(seen, dtype=torch.float32)).numpy().max(axis=1)
    return seen[:, 1], np.where(np.isnan(seen[:, 2]), np.nan, values)


def draw_values(values: Mapping[str, tuple[np.ndarray, np.ndarray]], words: str = "", top: float = 9.0) -> Figure:
    """Draw what networks think the places along the stairs are worth, see ``values_along``."""
    parts = [f"{name} {np.nanmin(worth):.2g} to {np.nanmax(worth):.2g}" for name, (_, worth) in values.items()]
    figure, ax = new_figure(
        f"Largest value of a network against the place along the stairs{', ' + words if words else ''}: {'; '.join(parts)}.",
        size=(6.4, 3.2),
    )
    for place, (name, (y, worth)) in enumerate(values.items()):
        ax.plot(y, worth, color=COLORS[1 + place], linestyle=("-", "--", ":")[place % 3], label=name)
    for riser in Staircase.fifteen().risers:
        ax.axvline(riser, color=GRID, linewidth=0.8, zorder=0)
    left = 15 - np.arange(15)
    starts = [0.0, *Staircase.fifteen().risers]
    worth = (1 - DISCOUNT**left) / (1 - DISCOUNT)
    ax.stairs(worth, starts, color=FAINT, baseline=None, linewidth=1, label="if each jump gained one step")
    ax.set(xlim=(0, 6.3), ylim=(-1, top), xlabel="y [m] (lines: risers)", ylabel="largest value")
    ax.set_title(words, fontsize=10, loc="left")
    ax.legend(frameon=False, fontsize=9, loc="upper right")
    return figure


def draw_schedule(settings: Mapping[str, Mapping[str, Any]], total_timesteps: int = 30_000) -> Figure:
    """Draw when an agent explores, learns, and copies its target network, for some settings of DQN."""
    words, rows = [], []
    for name, given in settings.items():
        copies = np.arange(given["target_update_interval"], total_timesteps + 1, given["target_update_interval"])
        words.append(f"{name}: learns from jump {given['learning_starts']:,} on, {len(copies)} copies of the target")
        rows.append((name, given, copies))
    figure, axes = new_figure(
        f"Share of random jumps against training. {'; '.join(words)}.", len(rows), (6.8, 3.6), columns=1
    )
    for ax, (name, given, copies) in zip(np.ravel(axes), rows, strict=True):
        steps = np.arange(0, total_timesteps + 1, 50)
        ends = given["exploration_fraction"] * total_timesteps
        share = 1 + np.minimum(steps / ends, 1) * (given["exploration_final_eps"] - 1)
        share = np.where(steps < given["learning_starts"], 1.0, share)
        ax.fill_between(steps, share, color=COLORS[0], alpha=0.6, linewidth=0, step="post")
        ax.axvline(given["learning_starts"], color=COLORS[1], linestyle="--", linewidth=1.6)
        ax.plot(
            copies, np.full(len(copies), 1.15), "v", color=PATH, markersize=7 if len(copies) < 20 else 3, clip_on=False
        )
        ax.set(xlim=(0, total_timesteps), ylim=(0, 1.2), yticks=[0, 0.5, 1], ylabel="random")
        ax.set_title(f"{name}: {len(copies)} copies (triangles)", fontsize=10, loc="left", pad=9)
    np.ravel(axes)[-1].set_xlabel("training [jumps] (dashed: learning begins; blue: share of random jumps)")
    return figure


def draw_memory(model: DQN) -> Figure:
    """Draw what is in an agent's replay buffer: where each jump began, and what it earned."""
    buffer = model.replay_buffer
    assert buffer is not None
    n = buffer.size()
    y, rewards = buffer.observations[:n, 0, 1], buffer.rewards[:n, 0]
    kinds = {
        "earned nothing": (rewards == 0, OFF_MAP, "o", 5),
        "climbed": (rewards > 0, COLORS[2], "^", 10),
        "fell": (rewards < 0, COLORS[4], "v", 10),
    }
    shares = ", ".join(f"{kind} {np.mean(mine):.0%}" for kind, (mine, *_) in kinds.items())
    figure, ax = new_figure(
        f"The {n:,} remembered jumps: place before the jump against its number, by what it earned: {shares}.",
        size=(6.8, 3.4),
    )
    for kind, (mine, color, marker, size) in kinds.items():
        label = f"{kind}: {np.mean(mine):.0%}".replace("%", " %")
        ax.scatter(np.flatnonzero(mine), y[mine], size, color=color, marker=marker, linewidths=0, label=label)
    ax.set(xlabel="number of the jump", ylabel="y before the jump [m]", xlim=(0, n))
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9, markerscale=1.8)
    return figure


def draw_network(sizes: Sequence[int], inputs: Sequence[str] = ("x", "y", "z", "d_obs")) -> Figure:
    """Draw a dense network as columns of neurons, with the parameters between them."""
    counts = [before * after + after for before, after in pairwise(sizes)]
    figure, ax = new_figure(
        f"A dense network with layers of {', '.join(map(str, sizes))} neurons and {' + '.join(f'{n:,}' for n in counts)} parameters.",
        size=(6.8, 3.2),
    )
    drawn = [np.linspace(-1, 1, min(size, MOST_NEURONS)) * min(1.0, size / 16 + 0.25) for size in sizes]
    for place, (left, right) in enumerate(pairwise(drawn)):
        for start in left:
            for end in right:
                ax.plot([place, place + 1], [start, end], color=GRID, linewidth=0.5, zorder=1)
        before, after = sizes[place], sizes[place + 1]
        words = f"{before} · {after} + {after}\n= {counts[place]:,}"
        ax.text(place + 0.5, -1.2, words, ha="center", va="top", fontsize=9)
    for place, (size, column) in enumerate(zip(sizes, drawn, strict=True)):
        ax.plot(np.full(len(column), place), column, "o", color=COLORS[1], markersize=6, zorder=2)
        role = ["numbers seen", "values, one a motion"][place > 0] if place in (0, len(sizes) - 1) else "hidden"
        ax.text(place, 1.12, f"{size}\n{role}", ha="center", va="bottom", fontsize=9)
    for name, height in zip(inputs, drawn[0], strict=False):
        ax.text(-0.08, height, name.replace("d_obs", "$d_{obs}$"), ha="right", va="center", fontsize=9)
    ax.set(xlim=(-0.45, len(sizes) - 0.5), ylim=(-1.6, 1.55))
    ax.set_axis_off()
    return figure


# The published curves, SAC, and the parameters


def draw_look_ahead(study: StudyResults, method: str = "uniform", every: int = 10_000) -> Figure:
    """Draw the published curves of a method between the copies of its target network."""
    curves = study.curves(method)
    mean, look = curves.mean(axis=1), method_style(method)
    last = int(mean.index[-1])
    bounds = [*range(0, last, every), last]
    phases = [mean[(mean.index > begin) & (mean.index <= end)] for begin, end in pairwise(bounds)]
    figure, ax = new_figure(
        f"Mean greedy return of {len(curves.columns)} agents ({look.label}) against training, and copies of the target every "
        f"{every:,} jumps; at the end of the phases {', '.join(f'{phase.iloc[-1]:.1f}' for phase in phases)}.",
        size=(6.8, 3.4),
    )
    ax.plot(curves.index, curves.to_numpy(), color=GRID, linewidth=0.8, zorder=1)
    ax.plot(mean.index, mean, color=look.color, linewidth=2, zorder=3)
    for number, begin in enumerate(bounds[:-1], 1):
        if begin:
            ax.axvline(begin, color=PATH, linestyle="--", linewidth=1.4)
        words = f"looks {number} jump{'s' if number > 1 else ''} ahead"
        ax.text(begin + every / 2, 15.9, words, ha="center", va="bottom", fontsize=9)
    ax.set(
        xlim=(0, last),
        ylim=(-2, 15.5),
        xlabel="training [jumps] (dashed: copies of the target)",
        ylabel="greedy return [reward]",
    )
    return figure


def policy_cloud(model: SAC, n: int = 400, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Draw motions from SAC's policy in the start pose.

    Returns
    -------
    drawn : ndarray of shape (n, 2)
        Magnitude [N] and angle [deg] of motions drawn from the policy.
    greedy : ndarray of shape (2,)
        The motion that an evaluation performs.
    """
    import torch

    start = np.array([0, START_Y, CUBE_EDGE / 2, Staircase.fifteen().d_obs(START_Y)], dtype=np.float32)
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        drawn, _ = model.predict(np.tile(start, (n, 1)), deterministic=False)
    greedy, _ = model.predict(start, deterministic=True)
    return np.asarray(drawn), np.asarray(greedy)


def draw_clouds(clouds: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> Figure:
    """Draw motions from policies in the motion plane, see ``policy_cloud``."""
    parts = [f"{name}, about {greedy[0]:.0f} N and {greedy[1]:.0f}°" for name, (_, greedy) in clouds.items()]
    figure, axes = new_figure(
        f"Motions that SAC draws in the start pose, and the one that it would perform: {'; '.join(parts)}.",
        len(clouds),
        (7.4, 3.2),
    )
    for ax, (name, (drawn, greedy)) in zip(np.ravel(axes), clouds.items(), strict=True):
        ax.plot(drawn[:, 1], drawn[:, 0], ".", color=COLORS[2], alpha=0.5, markersize=4)
        ax.plot(greedy[1], greedy[0], "*", color=INK, markersize=13)
        ax.set_title(name, fontsize=10, loc="left")
        _motion_limits(ax)
    return figure


def draw_chosen_motions(study: StudyResults) -> Figure:
    """Draw the motions of the trained SAC agents' last greedy episodes, and the grid that DQN may choose from."""
    jumps = study.episodes[study.episodes["method"] == "sac"]
    grid = study.motions[(study.motions["method"] == "uniform")]
    grid = grid[grid["seed"] == grid["seed"].min()]
    figure, ax = new_figure(
        f"Motions in the plane of angle and magnitude: {len(grid)} of the grid, and the {len(jumps)} jumps of trained SAC "
        f"agents; the median angle is {jumps['angle'].median():.0f}°.",
        size=(6.4, 3.8),
    )
    ax.plot(grid["angle"], grid["magnitude"], "s", color="white", markeredgecolor=INK, markersize=9, label="the grid")
    for place, (seed, mine) in enumerate(jumps.groupby("seed")):
        look = {"color": COLORS[place], "marker": MARKERS[place], "linestyle": "none", "alpha": 0.8, "markersize": 5}
        ax.plot(mine["angle"], mine["magnitude"], label=f"SAC, seed {seed}", **look)
    _motion_limits(ax)
    figure.legend(loc="outside right upper", frameon=False, fontsize=9)
    return figure


def _motion_limits(ax: Axes) -> None:
    ax.set(xlim=(-2, 92), ylim=(20, 1030), xlabel="angle [°]", ylabel="magnitude [N]", xticks=[1, 30, 60, 89])


def draw_parameters(dqn: Mapping[str, int], sac: Mapping[str, int]) -> Figure:
    """Draw two agents' parameters in each way of counting, see ``stairlab.count_parameters``."""
    ratios = {way: sac[way] / dqn[way] for way in dqn}
    figure, ax = new_figure(
        "Parameters of DQN and SAC, logarithmic: "
        + "; ".join(f"{way} {dqn[way]:,} and {sac[way]:,}, {ratio:.0f} times" for way, ratio in ratios.items())
        + ".",
        size=(6.8, 3.2),
    )
    rows = np.arange(len(dqn))
    ax.barh(rows - 0.2, list(dqn.values()), 0.38, color=COLORS[1], label="DQN, 16 motions")
    ax.barh(rows + 0.2, list(sac.values()), 0.38, color=COLORS[2], hatch="//", edgecolor="white", label="SAC")
    for row, (way, ratio) in enumerate(ratios.items()):
        ax.text(dqn[way] * 1.1, row - 0.2, f"{dqn[way]:,}", va="center", fontsize=9)
        ax.text(sac[way] * 1.1, row + 0.2, f"{sac[way]:,}: {ratio:.0f} times", va="center", fontsize=9)
    ax.set(
        xscale="log",
        xlim=(1e3, 6e6),
        xlabel="parameters",
        yticks=rows,
        yticklabels=list(dqn),
        ylim=(len(dqn) - 0.4, -0.6),
    )
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    return figure
