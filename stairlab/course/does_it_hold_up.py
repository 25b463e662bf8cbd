"""Lesson 10, does it hold up: how sure a few seeds make us, what decides a claim, and whether the world was the right one."""

from __future__ import annotations

import html
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from stairlab.claims import CONTRADICTED, SUPPORTED, UNDECIDED
from stairlab.course.engine import ENGINE_GAPS
from stairlab.drawing import (
    COLORS,
    FAINT,
    GRID,
    INK,
    figure_legend,
    legend_below,
    marker_handle,
    new_figure,
)
from stairlab.estimates import Estimate, estimate
from stairlab.fidelity import CLOSE, MODERATE_MOTIONS, TreadMeasures
from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.plots import draw_cube, draw_cube_from_above, draw_stairs, pose
from stairlab.results import TOP_STEP, StudyResults, load_published_study
from stairlab.study_plots import method_style, plot_learning_curves
from stairlab.world import CubeWorld, StairWorld, reach_of

if TYPE_CHECKING:
    import ipywidgets

SETS = ("effect", "uniform", "random")
""" The paper's three sets of motions """
SCORE = "score: mean greedy return of the last five evaluations [reward]"
TRUE_THERE, BEYOND, MARK = COLORS[2], COLORS[4], COLORS[1]
VERDICT_COLORS = {SUPPORTED: TRUE_THERE, CONTRADICTED: BEYOND, UNDECIDED: FAINT}
EQUAL = 1e-3
""" Means that differ by less are equal: a resting cube can lean a little [reward] """
RISER = 3
""" The riser before which a cube is pushed: in the middle of the stairs [number] """
STATEMENT = (
    "On the paper's stairs, DQN learns to climb better with a 4 by 4 grid of motions than with effect-based prototypes."
)
""" What the reader bets on, again and again; the paper says that it is false """

Region = tuple[float, float]


# How sure the reader is


class Certainty:
    """How sure the reader is of ``STATEMENT`` at a step of the lesson, in percent. Made by ``how_sure``.

    Attributes
    ----------
    step : str
        When it is asked.
    percent : float or None
        The reader's answer; the first one counts.
    """

    def __init__(self, step: str) -> None:
        self.step = step
        self.percent: float | None = None

    def commit(self, percent: float | str) -> str:
        """Record how sure the reader is, and say what was recorded.

        Raises
        ------
        ValueError
            If ``percent`` is not a number from 0 to 100.
        """
        try:
            value = float(percent)
        except (TypeError, ValueError):
            value = math.nan
        if not 0 <= value <= 100:
            raise ValueError(f"percent must be a number from 0 to 100, not {percent!r}.")
        if self.percent is None:
            self.percent = value
        return f"{self.percent:g} %: noted. There is no right answer here; you see all of yours at the end."

    @property
    def question(self) -> str:
        """What is asked."""
        return f"{self.step} How sure are you, from 0 to 100 %, that this is true? {STATEMENT}"

    def __repr__(self) -> str:
        if self.percent is None:
            return f"{self.question} Write it down, or run the cell with percent=..."
        return f"{self.question} {self.commit(self.percent)}"

    def _repr_html_(self) -> str:
        """Show the question, for pages without a kernel."""
        box = f"border-left:4px solid {COLORS[3]};padding:.3em .9em;margin:.4em 0;max-width:48em"
        return f'<div style="{box}"><strong>Commit.</strong> {html.escape(self.question)} <em>Write the number down.</em></div>'

    def widget(self) -> ipywidgets.Widget:
        """Return the live widget.

        Raises
        ------
        ImportError
            If ipywidgets is not installed.
        """
        import ipywidgets

        field = ipywidgets.Text(placeholder="0 to 100 [%]", description="sure to")
        button = ipywidgets.Button(description="That is how sure", button_style="primary")
        reply = ipywidgets.HTML()

        def commit(_: Any) -> None:
            try:
                words = self.commit(field.value)
            except ValueError:
                words = "Write a number from 0 to 100 first."
            else:
                field.disabled = button.disabled = True
            reply.value = f'<p aria-live="polite">{html.escape(words)}</p>'

        button.on_click(commit)
        question = ipywidgets.HTML(f"<strong>Commit.</strong> {html.escape(self.question)}")
        layout = ipywidgets.Layout(border_left=f"4px solid {COLORS[3]}", padding="0 1em")
        return ipywidgets.VBox([question, field, button, reply], layout=layout)

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        shown = {"text/plain": repr(self), "text/html": self._repr_html_()}
        if self.percent is not None:
            return {"text/plain": repr(self)}
        try:
            return self.widget()._repr_mimebundle_() | shown
        except ImportError:
            return shown


_asked: dict[str, Certainty] = {}


def how_sure(step: str, percent: float | None = None) -> Certainty:
    """Ask how sure the reader is of ``STATEMENT``. In a notebook there is a field; without widgets, give ``percent``.

    Parameters
    ----------
    step : str
        When it is asked: a sentence.
    percent : float, optional
        The answer, 0 to 100, where no widget can ask for it.

    Returns
    -------
    Certainty
    """
    asked = Certainty(step)
    if percent is not None:
        asked.commit(percent)
    _asked[step] = asked
    return asked


def my_certainty() -> pd.DataFrame:
    """Return how sure the reader was at each step of this session: "when", and "sure [%]" (only where a number was given)."""
    rows = [(asked.step, asked.percent) for asked in _asked.values() if asked.percent is not None]
    return pd.DataFrame(rows, columns=["when", "sure [%]"])


# Some of the seeds


def part_of(study: StudyResults, seeds: Mapping[str, Iterable[int]]) -> StudyResults:
    """Return a study with only some of its runs, as if no other had been made.

    Parameters
    ----------
    study : StudyResults
        The study.
    seeds : mapping of str to iterable of int
        The seeds to keep, for each method; methods that are not named are left out.

    Returns
    -------
    StudyResults
    """
    kept = {(method, int(seed)) for method, chosen in seeds.items() for seed in chosen}
    tables = {
        name: table[[run in kept for run in zip(table["method"], table["seed"], strict=True)]].reset_index(drop=True)
        for name in ("runs", "evaluations", "motions", "episodes")
        for table in [getattr(study, name)]
    }
    return StudyResults(description=study.description, **tables)


def drawn_seeds(study: StudyResults, n: int = 4, turn: int = 1) -> dict[str, np.ndarray]:
    """Draw ``n`` different seeds of each of the paper's three sets; with more seeds the first ones stay the same.

    Parameters
    ----------
    study : StudyResults
        The study.
    n : int
        Seeds of each set.
    turn : int
        Which draw; 0 is no draw, but the first ``n`` seeds.

    Returns
    -------
    dict of str to ndarray of shape (n,), int
    """
    drawn = {}
    for place, method in enumerate(SETS):
        every = np.sort(study.runs.loc[study.runs["method"] == method, "seed"].to_numpy())
        rng = np.random.default_rng([turn, place])
        drawn[method] = (rng.permutation(every) if turn else every)[:n]
    return drawn


def draw_drawn_curves(study: StudyResults, turn: int = 0, n: int = 4) -> Figure:
    """Draw figure 4 (a) of the paper from ``n`` drawn seeds of each set (see ``drawn_seeds``)."""
    part = part_of(study, drawn_seeds(study, n, turn))
    which = f"group {turn}: {n} seeds of each" if turn else f"seeds 0 to {n - 1} of each"
    title = f"{which}; mean scores: {order_of({method: float(part.scores(method).mean()) for method in SETS})}"
    figure, ax = new_figure(f"{title}.", size=(7.2, 4.6))
    plot_learning_curves(part, ax=ax)
    ax.set(ylim=(-4.5, 17))
    ax.set_title(title, fontsize=10)
    return figure


@cache
def _published() -> StudyResults:
    return load_published_study("plane")


@cache
def _mean_of(method: str) -> Estimate:
    return estimate(np.mean, _published().scores(method))


def means_of_draws(scores: np.ndarray, n: int, draws: int, rng: np.random.Generator) -> np.ndarray:
    """Draw ``n`` different ones of ``scores``, again and again, and return the mean of each draw; shape (draws,)."""
    return rng.permuted(np.tile(scores, (draws, 1)), axis=1)[:, :n].mean(axis=1)


def order_of(means: Mapping[str, float]) -> str:
    """Return names from the highest mean to the lowest, such as "uniform > effect = random"; equal ones as they come."""
    ranked = sorted(means, key=lambda name: -means[name])
    words = [ranked[0]]
    for before, name in itertools.pairwise(ranked):
        words += ["=" if means[before] - means[name] < EQUAL else ">", name]
    return " ".join(words)


def orders_of_draws(study: StudyResults, n: int = 4, draws: int = 10_000, seed: int = 0) -> pd.Series:
    """Count in which order the means of the three sets come, over draws of ``n`` seeds of each.

    Parameters
    ----------
    study : StudyResults
        The study.
    n : int
        Seeds of each set.
    draws : int
        Draws, each of different seeds.
    seed : int
        Source of the draws.

    Returns
    -------
    pandas.Series of float
        The share of each order, the most frequent first; orders with equal means are taken together as "two or more are equal".
    """
    rng = np.random.default_rng(seed)
    means = np.column_stack([means_of_draws(study.scores(method), n, draws, rng) for method in SETS])
    ranks = np.argsort(-means, axis=1)
    names = np.array([" > ".join(SETS[i] for i in (code // 9, code // 3 % 3, code % 3)) for code in range(27)])
    words = names[ranks @ [9, 3, 1]]
    tied = (np.abs(np.diff(np.sort(means, axis=1), axis=1)) < EQUAL).any(axis=1)
    return pd.Series(np.where(tied, "two or more are equal", words)).value_counts(normalize=True)


@cache
def _order_shares(n: int) -> pd.Series:
    return orders_of_draws(_published(), n, 4000)


def draw_seen_seeds(seeds: int = 4, turn: int = 1, answer: bool = False) -> Figure:
    """Draw the scores of some seeds of the three sets, and with ``answer`` those of all twenty with their means' intervals.

    Parameters
    ----------
    seeds : int
        Seeds of each set that are seen, 1 to 20.
    turn : int
        Which draw.
    answer : bool
        Show all seeds.

    Returns
    -------
    matplotlib Figure
    """
    study = _published()
    chosen = drawn_seeds(study, seeds, turn)
    figure, ax = new_figure(f"Scores of {seeds} of 20 seeds of three sets, draw {turn}.", size=(7.2, 3.6))
    means, words = {}, []
    for row, method in enumerate(SETS):
        look = method_style(method)
        runs = study.runs[study.runs["method"] == method].set_index("seed")["score"]
        seen = runs[chosen[method]].to_numpy()
        means[method] = float(seen.mean())
        words.append(f"{look.label}: mean {means[method]:.1f}")
        if answer:
            found = _mean_of(method)
            _draw_runs(ax, runs.to_numpy(), row + 0.24, method, color=FAINT, markersize=5)
            ax.plot([found.low, found.high], [row + 0.24] * 2, color=INK, linewidth=2.5)
            ax.plot(found.value, row + 0.24, "|", color=INK, markersize=14, markeredgewidth=2.5)
            words.append(f"all 20: {found}")
        _draw_runs(ax, seen, row - 0.16, method, markersize=7)
        ax.plot(means[method], row - 0.16, "|", color=look.color, markersize=22, markeredgewidth=3)
        above: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": 9, "color": look.color}
        ax.annotate(f"{means[method]:.1f}", (means[method], row - 0.36), **above)
    order = order_of(means)
    title = f"{_seeds(seeds)} of each: {order}"
    if answer:
        title += f"\nall 20: {order_of({m: _mean_of(m).value for m in SETS})}"
        share = _order_shares(seeds).get(order)
        if share is not None and seeds < len(study.scores(SETS[0])):
            title += f"; {_percent(share)} of all draws of {seeds} say what yours says"
    ax.set_title(title, fontsize=10, loc="left")
    _rows(ax, [method_style(method).label for method in SETS], SCORE)
    ax.set(xlim=(-0.8, 15.8), ylim=(2.6, -0.6), xticks=range(0, 16, 5))
    figure.stairlab_alt += f" {'; '.join(words)}. {title.replace(chr(10), '; ')}."  # type: ignore[attr-defined]
    return figure


# Means, and how far to trust them


def draw_average_run(scores: np.ndarray, label: str = "uniform") -> Figure:
    """Draw the score of each run in a row of counts, and mean and standard deviation as a figure of the paper would.

    Parameters
    ----------
    scores : ndarray of shape (n_seeds,)
        A score for each seed.
    label : str
        What made them.
    """
    mean, sd = float(scores.mean()), float(scores.std(ddof=1))
    figure, ax = new_figure(
        f"Scores of the {len(scores)} {label} runs, stacked by whole numbers: {_stack_words(scores)}. Their mean {mean:.1f}, with a "
        f"band of one standard deviation, {mean - sd:.1f} to {mean + sd:.1f}.",
        size=(6.4, 3.0),
    )
    places = np.round(scores).astype(int)
    for place in np.unique(places):
        count = int((places == place).sum())
        ax.plot([place] * count, np.arange(count) + 0.5, "o", color=COLORS[1], markersize=9, markeredgecolor="white")
    ax.axvspan(mean - sd, mean + sd, color=COLORS[1], alpha=0.15, linewidth=0, label="mean ± standard deviation")
    ax.axvline(mean, color=INK, linewidth=2, label=f"mean {mean:.2f}")
    ax.set(
        xlabel="score, rounded [reward]", ylabel="runs [count]", ylim=(0, np.bincount(places - places.min()).max() + 1)
    )
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.legend(frameon=False, fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2)
    return figure


def _stack_words(scores: np.ndarray) -> str:
    places, counts = np.unique(np.round(scores).astype(int), return_counts=True)
    return ", ".join(f"{count} at {place}" for place, count in zip(places, counts, strict=True))


def draw_episodes(study: StudyResults, method: str, seeds: Sequence[int]) -> Figure:
    """Draw on which step the cube stands after each jump of some trained agents' greedy episodes, a panel for each seed.

    Parameters
    ----------
    study : StudyResults
        The study.
    method : str
        The set of motions.
    seeds : sequence of int
        The agents.
    """
    figure, axes = new_figure(
        f"Steps reached, jump by jump, by {method_style(method).label} agents.",
        panels=len(seeds),
        columns=len(seeds),
        size=(3.3 * len(seeds), 2.9),
    )
    episodes = study.episodes[study.episodes["method"] == method]
    for ax, seed in zip(np.ravel(axes), seeds, strict=True):
        one = episodes[episodes["seed"] == seed]
        steps, total = [0, *one["steps"].tolist()], one["reward"].sum()
        ax.step(range(len(steps)), steps, where="post", color=method_style(method).color, linewidth=1.8)
        ax.plot(len(steps) - 1, steps[-1], "o", color=INK, markersize=6)
        ax.axhline(TOP_STEP, color=FAINT, linestyle="--", linewidth=1)
        ax.set(
            xlabel="jump [number]",
            ylabel="step [number]",
            ylim=(-0.6, TOP_STEP + 0.9),
            xlim=(-0.5, 52),
            yticks=range(0, 16, 5),
        )
        ax.set_title(f"seed {seed}: return {total:.1f}", fontsize=10)
        _say(
            figure,
            f"Seed {seed}: return {total:.1f}, up to step {max(steps)}, at the end on step {steps[-1]} after {len(one)} jumps.",
        )
    return figure


def draw_middle_half(scores: np.ndarray, label: str) -> Figure:
    """Draw sorted scores, the middle half of them filled, with mean, median and interquartile mean.

    Parameters
    ----------
    scores : ndarray of shape (n_seeds,)
        A score for each seed.
    label : str
        What made them.
    """
    ordered, cut = np.sort(scores), len(scores) // 4
    middle = ordered[cut : len(ordered) - cut]
    found = {"mean": ordered.mean(), "median": np.median(ordered), "interquartile mean": middle.mean()}
    figure, ax = new_figure(
        f"The {len(scores)} {label} scores in order, the middle half filled; {_named(found)}.", size=(6.4, 3.4)
    )
    kept = np.zeros(len(ordered), dtype=bool)
    kept[cut : len(ordered) - cut] = True
    ax.bar(
        np.arange(1, len(ordered) + 1),
        ordered,
        0.75,
        color=np.where(kept, COLORS[5], "white"),
        edgecolor=INK,
        linewidth=0.7,
        hatch=["" if inside else "////" for inside in kept],
    )
    for (name, value), line, color in zip(found.items(), ("--", ":", "-"), (COLORS[4], INK, COLORS[1]), strict=True):
        ax.axhline(value, linestyle=line, color=color, linewidth=2, label=f"{name} {value:.2f}")
    ax.set(xlabel=f"{label} runs, from the lowest to the highest [number]", ylabel="score [reward]")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.legend(frameon=False, fontsize=9, loc="upper left")
    return figure


def draw_resample(scores: np.ndarray, chosen: np.ndarray, label: str = "effect-based") -> Figure:
    """Draw how often each run was drawn into a resample, above its score.

    Parameters
    ----------
    scores : ndarray of shape (n_seeds,)
        A score for each seed.
    chosen : ndarray of shape (n_seeds,), int
        The places of the runs that were drawn.
    label : str
        What made them.
    """
    times, mean = np.bincount(chosen, minlength=len(scores)), float(scores[chosen].mean())
    figure, (upper, lower) = new_figure(
        f"{len(scores)} {label} runs, and how often each is in a resample: {(times == 0).sum()} never, {(times == 1).sum()} once, "
        f"{(times > 1).sum()} more often. Mean of the runs {scores.mean():.2f}, of the resample {mean:.2f}.",
        panels=2,
        columns=1,
        size=(6.4, 3.8),
    )
    runs = np.arange(len(scores))
    upper.bar(runs, times, 0.75, color=np.where(times == 0, "white", COLORS[1]), edgecolor=INK, linewidth=0.7)
    upper.set(ylabel="times drawn", ylim=(0, max(4, times.max() + 0.3)), xticks=[])
    upper.yaxis.set_major_locator(MaxNLocator(integer=True))
    lower.bar(runs, scores, 0.75, color=np.where(times == 0, "white", COLORS[4]), edgecolor=INK, linewidth=0.7)
    lower.axhline(
        scores.mean(), color=INK, linestyle="--", linewidth=1.5, label=f"mean of all runs {scores.mean():.2f}"
    )
    lower.axhline(mean, color=COLORS[1], linewidth=2, label=f"mean of this resample {mean:.2f}")
    lower.set(xlabel=f"{label} run [seed]", ylabel="score [reward]", xticks=runs)
    lower.legend(frameon=False, fontsize=9, loc="upper right", ncols=2)
    lower.set_ylim(0, 1.35 * scores.max())
    return figure


def draw_resampled(means: np.ndarray, shown: int, value: float, xlabel: str = "mean of a resample [reward]") -> Figure:
    """Draw the distribution of the first ``shown`` resampled statistics; from 40 on with the interval that holds 95 % of them.

    Parameters
    ----------
    means : ndarray of shape (n_resamples,)
        A statistic of each resample.
    shown : int
        How many of them are drawn.
    value : float
        The statistic of the runs themselves.
    xlabel : str
        What the statistic is.
    """
    first = means[:shown]
    figure, ax = new_figure(f"Histogram of {shown:,} resampled statistics about {value:.2f}.", size=(6.4, 3.0))
    edges = np.linspace(means.min(), means.max(), 41)
    counts, _, bars = ax.hist(first, edges, color=COLORS[0], edgecolor="white", linewidth=0.4)
    top = 1.12 * max(counts.max(), 2.0)
    ax.plot([value, value], [0, top], color=INK, linewidth=2, label=f"of the runs themselves: {value:.2f}")
    if shown >= 40:
        low, high = np.quantile(first, [0.025, 0.975])
        for bar, left, right in zip(bars, edges, edges[1:], strict=False):
            if right < low or left > high:
                bar.set(facecolor="white", edgecolor=INK, hatch="////")
        for end in (low, high):
            ax.plot([end, end], [0, top], color=COLORS[4], linestyle="--", linewidth=1.8)
        ax.plot([], [], color=COLORS[4], linestyle="--", label=f"95 % lie between {low:.2f} and {high:.2f}")
        _say(figure, f"95 % lie between {low:.2f} and {high:.2f}.")
    ax.set(xlabel=xlabel, ylabel="resamples [count]", xlim=(edges[0], edges[-1]), ylim=(0, 1.4 * top))
    ax.set_title(f"{shown:,} resample{'s'[: shown != 1]}", fontsize=10)
    ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    ax.legend(frameon=False, fontsize=9, loc="upper right")
    return figure


def coverage(
    scores: np.ndarray, n_seeds: Sequence[int], studies: int = 1000, resamples: int = 999, seed: int = 0
) -> np.ndarray:
    """Say how often the 95 % bootstrap interval holds the true mean, if ``scores`` were all runs that there are.

    Parameters
    ----------
    scores : ndarray of shape (n_runs,)
        The population: a study of n seeds draws n of them, with replacement.
    n_seeds : sequence of int
        Seeds of a study.
    studies : int
        Studies that are made up for each number of seeds.
    resamples : int
        Resamples behind each interval.
    seed : int
        Source of all randomness.

    Returns
    -------
    ndarray of shape (len(n_seeds),)
        The share of studies whose interval holds the mean of ``scores``.
    """
    rng, shares = np.random.default_rng(seed), []
    for n in n_seeds:
        drawn = rng.choice(scores, size=(studies, n))
        held = 0
        for runs in drawn:
            low, high = np.quantile(runs[rng.integers(n, size=(resamples, n))].mean(axis=1), [0.025, 0.975])
            held += low - EQUAL <= scores.mean() <= high + EQUAL
        shares.append(held / studies)
    return np.array(shares)


# Intervals, and what they decide


def verdict(found: Estimate, region: Region) -> str:
    """Judge a claim by an interval: a claim says that a number lies in a region.

    Parameters
    ----------
    found : Estimate
        What was found, with its interval.
    region : (float, float)
        Where the number lies if the claim is true; an end may be infinite.

    Returns
    -------
    str
        "supported" if the whole interval lies in the region, "contradicted" if it lies outside, else "undecided".
    """
    low, high = region
    if found.low > low and found.high < high:
        return SUPPORTED
    return CONTRADICTED if found.high < low or found.low > high else UNDECIDED


def draw_intervals(
    found: Mapping[str, Estimate],
    xlabel: str,
    regions: Mapping[str, Region] | None = None,
    mark: float | None = 0.0,
    ax: Axes | None = None,
) -> Figure:
    """Draw estimates with their intervals, one below the other; with ``regions``, where a claim is true, and the verdict.

    Parameters
    ----------
    found : mapping of str to Estimate
        What was estimated.
    xlabel : str
        The quantity, with its unit.
    regions : mapping of str to (float, float), optional
        For each estimate the region in which a claim is true.
    mark : float, optional
        Where to draw a line from top to bottom.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.
    """
    given = regions or {}
    if ax is None:
        figure, ax = new_figure(f"Intervals of {len(found)} estimates, {xlabel}.", size=(7.2, 1.2 + 0.46 * len(found)))
    figure = ax.figure.figure  # type: ignore[assignment]
    ends = np.array([number for one in found.values() for number in one if np.isfinite(number)])
    bounds = [bound for region in given.values() for bound in region if math.isfinite(bound)]
    ends = np.concatenate([ends, bounds, [] if mark is None else [mark]])
    room = 0.08 * float(np.ptp(ends) or 1.0)
    left, right = float(ends.min()) - room, float(ends.max()) + room
    words = []
    for row, (name, one) in enumerate(found.items()):
        color, said = MARK, ""
        if name in given:
            low, high = (float(np.clip(bound, left, right)) for bound in given[name])
            ax.fill_betweenx([row - 0.36, row + 0.36], low, high, color=TRUE_THERE, alpha=0.18, linewidth=0, zorder=0)
            said = verdict(one, given[name])
            color = VERDICT_COLORS[said]
            ax.annotate(said, (1.01, row), xycoords=("axes fraction", "data"), va="center", fontsize=9, color=INK)
        if np.isfinite(one.low):
            ax.plot(
                [one.low, one.high], [row, row], color=color, linewidth=4, alpha=0.85, solid_capstyle="butt", zorder=3
            )
        ax.plot(one.value, row, "o", color=INK, markersize=6, zorder=4)
        words.append(f"{name.replace(chr(10), ' ')} {_estimate_words(one)}{f', {said}' if said else ''}")
    if mark is not None:
        ax.axvline(mark, color=INK, linewidth=1.2, linestyle="--", zorder=1)
    _rows(ax, list(found), xlabel)
    ax.set_xlim(left, right)
    _say(figure, f"{'; '.join(words)}.")
    return figure


def _estimate_words(found: Estimate) -> str:
    digits = ".2f" if abs(found.value) < 100 else ",.0f"
    interval = f" [{found.low:{digits}}, {found.high:{digits}}]" if np.isfinite(found.low) else ""
    return f"{found.value:{digits}}{interval}"


def draw_orders(shares: pd.Series, n: int = 4) -> Figure:
    """Draw how often each order of the three sets comes out of draws (see ``orders_of_draws``)."""
    figure, ax = new_figure(
        f"Orders of the means of {n} seeds of each set: {'; '.join(f'{name} {_percent(share)}' for name, share in shares.items())}.",
        size=(6.8, 0.9 + 0.36 * len(shares)),
    )
    firsts = [name.split(" ")[0] for name in shares.index]
    colors = [method_style(first).color if first in SETS else FAINT for first in firsts]
    ax.barh(range(len(shares)), 100 * shares.to_numpy(), 0.7, color=colors, edgecolor=INK, linewidth=0.6)
    for row, share in enumerate(shares):
        ax.annotate(_percent(share), (100 * share, row), (4, 0), textcoords="offset points", va="center", fontsize=9)
    _rows(ax, list(shares.index), f"share of draws of {n} seeds of each [%]")
    ax.set_xlim(0, 1.15 * 100 * shares.max())
    return figure


def draw_pairs(first: np.ndarray, second: np.ndarray, names: tuple[str, str]) -> Figure:
    """Draw every run of one set against every run of another: which of the two scores higher.

    Parameters
    ----------
    first, second : ndarray of shape (n_seeds,), (m_seeds,)
        Scores.
    names : (str, str)
        What made them.
    """
    x, y = np.sort(first), np.sort(second)
    sign = np.where(np.abs(x[:, None] - y) < EQUAL, 0, np.sign(x[:, None] - y)).astype(int)
    shares = {words: float((sign == s).mean()) for words, s in _pair_words(names).items()}
    figure, ax = new_figure(
        f"{len(x)} times {len(y)} pairs of runs: {'; '.join(f'{words} {_percent(share)}' for words, share in shares.items())}.",
        size=(6.6, 4.2),
    )
    looks = {1: (COLORS[4], "o"), 0: ("white", "s"), -1: (COLORS[5], "^")}
    for words, s in _pair_words(names).items():
        i, j = np.nonzero(sign == s)
        color, marker = looks[s]
        ax.plot(j + 1, i + 1, marker, color=color, markersize=6, markeredgecolor=INK, markeredgewidth=0.5,
                label=f"{words}: {_percent(shares[words])}")  # fmt: skip
    ax.set(xlabel=f"{names[1]} runs, by score [reward]", ylabel=f"{names[0]} runs, by score [reward]", aspect="equal")
    ax.set_xticks(np.arange(1, len(y) + 1), [f"{round(score, 1) + 0:g}" for score in y], fontsize=7, rotation=90)
    ax.set_yticks(np.arange(1, len(x) + 1), [f"{round(score, 1) + 0:g}" for score in x], fontsize=7)
    ax.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _pair_words(names: tuple[str, str]) -> dict[str, int]:
    return {f"{names[0]} higher": 1, "equal": 0, f"{names[1]} higher": -1}


# Set size, settings, trap


def draw_set_sizes(study: StudyResults, methods: Sequence[str] = (*SETS, "fixed")) -> Figure:
    """Draw the score of each run against the number of motions in its set."""
    runs = study.runs[study.runs["method"].isin(methods)]
    ranges = "; ".join(
        f"{method_style(method).label} {rows['actions'].min():.0f} to {rows['actions'].max():.0f} motions"
        for method, rows in runs.groupby("method", sort=False)
    )
    figure, ax = new_figure(f"Score against the number of motions in the set: {ranges}.", size=(6.8, 3.8))
    handles = []
    for place, method in enumerate(methods):
        look, rows = method_style(method), runs[runs["method"] == method]
        nudge = 0.12 * (place - (len(methods) - 1) / 2)
        ax.plot(rows["actions"] + nudge, rows["score"] + _spread_out(len(rows), 0.3), look.marker, color=look.color, markersize=6,
                alpha=0.75, markeredgecolor="white", markeredgewidth=0.5)  # fmt: skip
        handles.append(marker_handle(look.color, look.marker, look.label))
    ax.set(xlabel="motions in the set [count]", ylabel="score [reward]")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_axisbelow(True)
    ax.grid(color=GRID)
    figure_legend(ax, handles, "lower center", len(handles))
    return figure


def draw_gap_jumps(gap: float = 7.0, angles: Sequence[float] = (85.0, 89.0), magnitude: float = 500.0) -> Figure:
    """Draw jumps from a small gap before a riser, a panel for each angle.

    Parameters
    ----------
    gap : float
        Gap between the cube's front and the riser [mm].
    angles : sequence of float
        Direction of each push above the y-axis [deg].
    magnitude : float
        Force of each push [N].
    """
    stairs = Staircase.fifteen()
    riser, floor = float(stairs.risers[RISER]), RISER * stairs.rise
    figure, axes = new_figure(
        f"A cube {gap:g} mm before a riser is pushed with {magnitude:g} N.",
        panels=len(angles),
        size=(3.2 * len(angles), 4.4),
    )
    words = []
    for ax, angle in zip(np.ravel(axes), angles, strict=True):
        world = StairWorld(stairs)
        world.reset(world.state_at(riser - gap / 1000 - CUBE_EDGE / 2, floor + CUBE_EDGE / 2))
        jump = world.jump(magnitude, angle, trajectory=True)
        path, gained = jump.trajectory, round(jump.dz / stairs.rise)
        assert path is not None
        highest = float(path.z.max())
        draw_stairs(ax, stairs, floor + 2.4, riser + 0.8)
        ax.plot(path.y, path.z, color="#c0392b", linewidth=1.5, zorder=3)
        draw_cube(ax, *pose(jump.start), facecolor="none", linestyle="--")
        draw_cube(ax, *pose(jump.end))
        result = (
            f"gains {gained} step{'s'[: gained != 1]}"
            if gained > 0
            else "stays below"
            if gained == 0
            else f"falls {-gained}"
        )
        limit = stairs.rise / math.tan(math.radians(angle)) * 1000
        ax.set(xlim=(riser - 0.35, riser + 0.45), ylim=(floor - 0.12, max(highest + 0.15, floor + 0.6)))
        ax.set_title(f"{angle:g}°: {result}\nh / tan α = {limit:.1f} mm", fontsize=10)
        words.append(f"At {angle:g} degrees it {result}; h / tan α is {limit:.1f} mm.")
    _say(figure, " ".join(words))
    return figure


def draw_worlds(studies: Mapping[str, StudyResults], methods: Sequence[str] = SETS) -> Figure:
    """Draw every run's score in several worlds, a panel for each, with the means.

    Parameters
    ----------
    studies : mapping of str to StudyResults
        A study for each world.
    methods : sequence of str
        The sets.
    """
    figure, axes = new_figure(
        "Scores by set in several worlds.",
        panels=len(studies),
        columns=len(studies),
        size=(3.0 * len(studies) + 0.4, 3.2),
    )
    lowest = min(study.scores(method).min() for study in studies.values() for method in methods)
    for ax, (world, study) in zip(np.ravel(axes), studies.items(), strict=True):
        for row, method in enumerate(methods):
            look, scores = method_style(method), study.scores(method)
            _draw_runs(ax, scores, row, method)
            ax.plot(scores.mean(), row, "|", color=INK, markersize=22, markeredgewidth=2.5)
            ax.annotate(f"{scores.mean():.1f}", (scores.mean(), row - 0.3), ha="center", va="bottom", fontsize=9)
            _say(figure, f"{world}, {look.label}: mean {scores.mean():.1f} of {_seeds(len(scores))}.")
        _rows(
            ax,
            [method_style(method).label for method in methods] if ax is np.ravel(axes)[0] else [""] * len(methods),
            "score [reward]",
        )
        ax.set(xlim=(min(lowest, 0) - 0.8, 15.8), ylim=(len(methods) - 0.4, -0.65), xticks=range(0, 16, 5))
        ax.set_title(world, fontsize=10)
    return figure


# Jumps from treads, in both worlds


def draw_resting(measured: Mapping[str, TreadMeasures], shown: int = 60) -> Figure:
    """Draw resting cubes from above, all on one tread: a panel for each world.

    Parameters
    ----------
    measured : mapping of str to TreadMeasures
        What was measured on rollouts in each world.
    shown : int
        Cubes in each panel, the first ones.
    """
    figure, axes = new_figure(
        "Resting cubes on a tread, from above; the riser is at the right.",
        panels=len(measured),
        size=(3.6 * len(measured), 3.6),
    )
    for ax, (name, one) in zip(np.ravel(axes), measured.items(), strict=True):
        for gap, yaw, aside in list(zip(one.gaps, one.yaws, one.asides, strict=True))[:shown]:
            half = math.radians(yaw) / 2
            y, turned = -gap - reach_of(yaw), np.array([0, 0, math.sin(half), math.cos(half)])
            draw_cube_from_above(ax, aside, y, turned, alpha=0.35, linewidth=0.8)
        ax.axvline(0, color=INK, linewidth=4)
        ax.set(xlim=(-0.42, 0.02), ylim=(-0.1, 0.7), aspect="equal", xlabel="y before the riser [m]", ylabel="|x| [m]")
        ax.set_title(f"{name}: {min(shown, len(one.gaps))} cubes", fontsize=10)
        gap, yaw, aside = (np.median(values) for values in (one.gaps, one.yaws, one.asides))
        _say(
            figure,
            f"{name}: in the median {1000 * gap:.0f} mm before it, turned by {yaw:.0f} degrees, {100 * aside:.0f} cm aside.",
        )
    return figure


def draw_tread_gaps(measured: Mapping[str, TreadMeasures]) -> Figure:
    """Draw the share of resting cubes that lie nearer to a riser than a gap, for two worlds at most, and the authors' engine.

    Parameters
    ----------
    measured : mapping of str to TreadMeasures
        What was measured on rollouts in each world.
    """
    figure, ax = new_figure("Share of resting cubes that lie nearer to a riser than a gap.", size=(6.8, 3.8))
    for (name, one), line, color in zip(measured.items(), ("-", "--"), (COLORS[4], COLORS[1]), strict=False):
        ordered, shares = np.sort(1000 * one.gaps), 100 * np.arange(1, len(one.gaps) + 1) / len(one.gaps)
        ax.plot(ordered, shares, line, color=color, linewidth=2.2, label=name)
        close, median = float((one.gaps < CLOSE).mean()), 1000 * np.median(one.gaps)
        _say(figure, f"{name}: {_percent(close)} within {1000 * CLOSE:g} mm, median {median:.0f} mm.")
    look: dict[str, Any] = {"color": INK, "markersize": 7, "label": "the authors' engine (quantiles)"}
    ax.plot(list(ENGINE_GAPS.values()), list(ENGINE_GAPS), "D", **look)
    _say(figure, f"The authors' engine: median {ENGINE_GAPS[50]:g} mm.")
    ax.axvspan(0, 1000 * CLOSE, color=FAINT, alpha=0.25, linewidth=0, label="the trap: no ordinary push climbs")
    ax.set(xlim=(-4, 350), ylim=(0, 100), xlabel="gap to the riser ahead [mm]", ylabel="cubes that lie nearer [%]")
    legend_below(ax, ncols=2)
    return figure


def climb_chances(
    world: CubeWorld, gaps: Sequence[float], jumps: int = 60, yaw: float = 0.0, seed: int = 0
) -> np.ndarray:
    """Put the cube at rest before a riser, push it moderately, and count how often it climbs.

    Parameters
    ----------
    world : StairWorld or TumblingWorld
        A world with some steps above ``RISER``.
    gaps : sequence of float
        Gaps between its foremost corner and the riser [m].
    jumps : int
        Jumps from each gap, with moderate motions (``fidelity.MODERATE_MOTIONS``); the same ones for each.
    yaw : float
        By how much the cube is turned about the vertical [deg].
    seed : int
        Source of the motions and of what is random in the world.

    Returns
    -------
    ndarray of shape (len(gaps),)
        The share of jumps that end on the map, at a higher level.
    """
    stairs, z = world.staircase, RISER * world.staircase.rise + CUBE_EDGE / 2
    shares = []
    for gap in gaps:
        start = world.state_at(stairs.risers[RISER] - gap - reach_of(yaw), z, yaw=math.radians(yaw))
        rng, climbed = np.random.default_rng(seed), 0
        for _ in range(jumps):
            world.reset(start)
            jump = world.perform(rng.uniform(*MODERATE_MOTIONS), np.random.default_rng(rng.integers(2**32)))
            climbed += jump.on_map and jump.dz > stairs.rise / 2
        shares.append(climbed / jumps)
    world.reset()
    return np.array(shares)


def draw_climb_chances(gaps: Sequence[float], chances: Mapping[str, np.ndarray], jumps: int) -> Figure:
    """Draw how often a moderate jump climbs against the gap from which it starts: a curve for each world.

    Parameters
    ----------
    gaps : sequence of float
        Gaps [m].
    chances : mapping of str to ndarray of shape (len(gaps),)
        For each world, the shares.
    jumps : int
        Jumps behind each share.
    """
    figure, ax = new_figure(f"How often a moderate jump climbs, against the gap; {jumps} jumps each.", size=(6.4, 3.4))
    looks = zip(("o", "s", "^"), ("-", "--", ":"), (COLORS[4], COLORS[1], COLORS[2]), strict=True)
    x = 1000 * np.asarray(gaps)
    for (name, shares), (marker, line, color) in zip(chances.items(), looks, strict=False):
        error = 100 * np.sqrt(np.maximum(shares * (1 - shares), 0.25 / jumps) / jumps)
        ax.errorbar(x, 100 * shares, error, marker=marker, linestyle=line, color=color, label=name, capsize=2)
        _say(
            figure,
            f"{name}: {', '.join(f'{gap:g} mm {_percent(share)}' for gap, share in zip(x, shares, strict=True))}.",
        )
    ax.set(xlabel="gap between the foremost corner and the riser [mm]", ylabel="jumps that climb [%]", ylim=(-3, 105))
    legend_below(ax, ncols=len(chances))
    return figure


def easier(first: np.ndarray, second: np.ndarray, alike: float = 0.1) -> str:
    """Say in which world jumps climb more often, from the shares of the plane and of the tumbling world, see ``climb_chances``."""
    apart = float((second - first).mean())
    return "about alike" if abs(apart) <= alike else "in the tumbling world" if apart > 0 else "in the plane"


# The study in three dimensions


def controls(tumbling: StudyResults, published: StudyResults) -> pd.DataFrame:
    """Say what a study must show before its verdicts count, and what it shows.

    Parameters
    ----------
    tumbling, published : StudyResults
        The study whose verdicts are asked for, and one with the authors' readings of the environment.

    Returns
    -------
    pandas.DataFrame
        "control", what it "should be", and what it "is".
    """
    rows = [
        ("SAC, which may use any motion", "near 15, as in the paper", _score_words(tumbling, "sac")),
        ("SAC, their readings", "14 to 15, as in their engine", _score_words(published, "sac")),
        (
            "the authors' own 17 motions, their readings",
            "about 5.5, as in their engine",
            _score_words(published, "authors"),
        ),
        ("the grid, their readings", "about 0.1, as in their engine", _score_words(published, "uniform")),
    ]
    for method in SETS:
        runs = tumbling.runs[tumbling.runs["method"] == method].drop_duplicates(
            "best_return" if method == "uniform" else "seed"
        )
        rows.append(
            (
                f"best return that a search finds for {method}",
                "15 or near",
                f"{runs['best_return'].mean():.1f} on average",
            )
        )
    return pd.DataFrame(rows, columns=["control", "should be", "is"])


def _score_words(study: StudyResults, method: str) -> str:
    scores = study.scores(method)
    return f"mean {estimate(np.mean, scores)}, {scores.min():.1f} to {scores.max():.1f} ({_seeds(len(scores))})"


def draw_accounts(studies: Mapping[str, StudyResults], methods: Sequence[str] = SETS) -> Figure:
    """Draw what greedy episodes earn by climbing and lose by falling, and how many steps a climb gains, in each world.

    Parameters
    ----------
    studies : mapping of str to StudyResults
        By the name of the world.
    methods : sequence of str
        Which to show.

    Returns
    -------
    matplotlib Figure
    """
    figure, panels = new_figure(
        "What greedy episodes earn and lose.", panels=2, size=(9.5, 0.8 + 0.42 * len(methods) * len(studies))
    )
    rows = [(world, method) for world in studies for method in methods if method in studies[world].methods]
    tables = {world: study.accounts().set_index("method") for world, study in studies.items()}
    earned, height = panels
    for place, (world, method) in enumerate(rows):
        row, color = tables[world].loc[method], method_style(method).color
        earned.barh(place, row["climb"], color=color)
        earned.barh(place, row["lost"], color=color, hatch="///", edgecolor="white")
        height.barh(place, row["steps a climb"], color=color)
    names = [f"{method_style(method).label}, {world}" for world, method in rows]
    _rows(earned, names, "earned by climbing, lost by falling (hatched) [reward]")
    _rows(height, [""] * len(rows), "steps that a climb gains")
    earned.axvline(0, color=INK, linewidth=0.8)
    words = [
        f"{name}: earns {tables[world].loc[method, 'climb']:.1f}, loses {-tables[world].loc[method, 'lost']:.1f}, "
        f"{tables[world].loc[method, 'steps a climb']:.1f} steps a climb"
        for name, (world, method) in zip(names, rows, strict=True)
    ]
    _say(figure, f"{'; '.join(words)}.")
    return figure


# What all of them use


def _rows(ax: Axes, names: Sequence[str], xlabel: str) -> None:
    """Make axes of rows, from top to bottom."""
    ax.set_yticks(range(len(names)), list(names))
    ax.set(ylim=(len(names) - 0.45, -0.55), xlabel=xlabel)
    ax.set_axisbelow(True)
    ax.grid(axis="x", color=GRID)
    ax.spines[["left"]].set_visible(False)
    ax.tick_params(axis="y", length=0)


def _draw_runs(ax: Axes, scores: np.ndarray, row: float, method: str, **style: Any) -> None:
    """Draw a mark for each run of a method, in a row; equal ones apart."""
    look = method_style(method)
    drawn: dict[str, Any] = {
        "color": look.color,
        "markersize": 6,
        "markeredgecolor": "white",
        "markeredgewidth": 0.5,
    } | style
    ax.plot(scores, row + _spread_out(len(scores)), look.marker, alpha=0.75, **drawn)


def _spread_out(count: int, width: float = 0.16) -> np.ndarray:
    """Return places about 0 that keep equal values apart, the same each time: steps of the golden ratio."""
    return width * ((np.arange(count) * (5**0.5 - 1) / 2 + 0.5) % 1 - 0.5)


def _seeds(count: int) -> str:
    return f"{count} seed{'s'[: count != 1]}"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %" if 0 < share < 0.095 else f"{100 * share:.0f} %"


def _named(found: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {value:.2f}" for name, value in found.items())


def _say(figure: Figure, words: str) -> None:
    """Add words to a figure's alternative text."""
    setattr(figure, "stairlab_alt", f"{getattr(figure, 'stairlab_alt', '')} {words}".strip())  # noqa: B010
