"""The claims of the paper's results section (section 4), each set beside what a study finds; for two worlds side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from stairlab.estimates import FEWEST_SEEDS, Estimate, holm
from stairlab.results import SAME_RETURN, TOP_STEP, StudyResults

SUPPORTED, CONTRADICTED, UNDECIDED = "supported", "contradicted", "undecided"
QUICK_VERDICT = "quick: says nothing"
SIMILAR_STEPS = 2000
""" "Similarly fast" is read as: within as many training steps as the effect-based sets have samples; "way slower" as: by more """
ONE_STEP = 1.0
""" "Close in average reward" and "similar standard deviation" are read as: within one step of the stairs """
LEVEL = 0.05
""" A verdict stands among all rows if its adjusted p-value is below this """
PAPER_RATIO = 85
""" SAC's parameters for each of DQN's, as the paper counts them """
SHARE_THAT_MATTERS = 0.1
""" "Some runs" is read as: at least this share of them. Where it never happened in n runs, the share is below 3 / n (95 % sure) """
DISCRETE = ("effect", "uniform", "random")
""" The paper's discrete methods """


class Finding(NamedTuple):
    """What a study finds on a claim: in words, the verdict, and the p-value behind it (NaN where nothing is tested)."""

    words: str
    verdict: str
    p: float = np.nan


class Claim(NamedTuple):
    """What the paper says, the methods that it is about, how to judge it, and what to say where two worlds differ on it."""

    says: str
    methods: tuple[str, ...]
    judge: Callable[[StudyResults], Finding]
    why: Callable[[StudyResults, StudyResults], str] = lambda tumbling, plane: ""


def paper_claims(results: StudyResults) -> pd.DataFrame:
    """Set the claims of the paper's results section (and its abstract's) beside what a study finds, a row for each sentence.

    A claim of a difference is supported if the 95 % bootstrap interval over seeds lies wholly on the claimed side, and contradicted
    if it lies on the other. A claim of likeness is supported if the interval lies within a margin, and contradicted if it lies beyond:
    2,000 training steps for "similarly fast" (and beyond for "way slower"), one step of the stairs for "close in average reward" and
    a "similar" standard deviation. Else, and with five seeds or fewer, it is undecided. "Some runs" is supported by one such run;
    that none was seen contradicts it only where a share of a tenth can be excluded. Sentences about the same difference share a row.

    Parameters
    ----------
    results : StudyResults
        The study.

    Returns
    -------
    pandas.DataFrame
        "the paper says", "we find", the "seeds" of each method, the "verdict" of the row alone ("supported", "contradicted",
        "undecided"; for a quick study "quick: says nothing"), "p" (two-sided, by the bootstrap: of the claim that the difference is 0,
        or just the nearer margin; NaN where nothing is tested), "p (Holm)", which allows for the number of rows, and the verdict
        "among all rows", which is undecided where that is 0.05 or more. Claims about methods that the study lacks are left out.
    """
    claims = [claim for claim in _CLAIMS if set(claim.methods) <= set(results.methods)]
    rows = [(claim.says, _seeds(results, claim.methods), *claim.judge(results)) for claim in claims]
    table = pd.DataFrame(rows, columns=["the paper says", "seeds", "we find", "verdict", "p"])
    table["p (Holm)"] = holm(table["p"].to_numpy(dtype=float))
    table["among all rows"] = table["verdict"].mask(table["p (Holm)"] >= LEVEL, UNDECIDED)
    return table.assign(**{"verdict": QUICK_VERDICT, "among all rows": QUICK_VERDICT}) if results.quick else table


def compare_claims(tumbling: StudyResults, plane: StudyResults) -> pd.DataFrame:
    """Judge the claims in three dimensions, with what the plane says beside it.

    Parameters
    ----------
    tumbling, plane : StudyResults
        The two studies. The verdict is about the first: the task is made of jumps from treads, and there the plane is not faithful.

    Returns
    -------
    pandas.DataFrame
        As ``paper_claims`` of the first, with "in the plane", "seeds in the plane", "verdict in the plane" (empty where that study
        lacks a method), and "why they differ" where the two verdicts do: what was measured in both worlds that may explain it.
    """
    table, other = paper_claims(tumbling), paper_claims(plane).set_index("the paper says")
    says = table["the paper says"]
    for column, name in (
        ("in the plane", "we find"),
        ("seeds in the plane", "seeds"),
        ("verdict in the plane", "verdict"),
    ):
        table[column] = [other[name].get(claim, "") for claim in says]
    differs = (table["verdict in the plane"] != "") & (table["verdict"] != table["verdict in the plane"])
    why = {claim.says: claim.why for claim in _CLAIMS}
    table["why they differ"] = [
        why[claim](tumbling, plane) if there else "" for claim, there in zip(says, differs, strict=True)
    ]
    return table


def _above(found: Estimate, bound: float = 0.0) -> str:
    """Judge the claim that a difference is above a bound."""
    return SUPPORTED if found.low > bound else CONTRADICTED if found.high < bound else UNDECIDED


def _alike(found: Estimate, margin: float) -> str:
    """Judge the claim that a difference is no larger than a margin."""
    if -margin <= found.low and found.high <= margin:
        return SUPPORTED
    return CONTRADICTED if found.low > margin or found.high < -margin else UNDECIDED


def _nearer(found: Estimate, margin: float) -> float:
    """Return the end of the range from -margin to margin that an estimate is nearer to."""
    return margin if found.value > 0 else -margin


def _all_above(found: Iterable[Estimate]) -> str:
    """Judge the claim that each of several differences is above 0."""
    verdicts = [_above(difference) for difference in found]
    return next((verdict for verdict in (CONTRADICTED, UNDECIDED) if verdict in verdicts), SUPPORTED)


# How each claim is judged, in the order of the table at the end.


def _higher_return(other: str, results: StudyResults) -> Finding:
    found = results.difference("effect", other)
    better = results.probability_of_improvement("effect", other)
    return Finding(
        f"mean score {_mean(results, 'effect')} against {_mean(results, other)}: difference {found}; a run of the first beats one "
        f"of the second with probability {_two(better)}",
        _above(found),
        results.p_value("effect", other),
    )


def _close(other: str, results: StudyResults) -> Finding:
    found = results.difference("effect", other)
    return Finding(
        f"mean score {_mean(results, 'effect')} against {_mean(results, other)}: difference {found}",
        _alike(found, ONE_STEP),
        results.p_value("effect", other, bound=_nearer(found, ONE_STEP)),
    )


def _higher_maximum(results: StudyResults) -> Finding:
    others = ("uniform", "random")
    found = {method: results.difference("effect", method, "peak") for method in others}
    highest = results.curves("effect").mean(axis=1).max()
    return Finding(
        f"the mean curve of effect reaches {highest:.1f}, above the others' by {_by_method(found)}",
        _all_above(found.values()),
        max(results.p_value("effect", method, "peak") for method in others),
    )


def _later(other: str, bound: float, results: StudyResults) -> Finding:
    found = results.difference(other, "effect", "half at")
    return Finding(
        _half_way(results, other, found),
        _above(found, bound),
        results.p_value(other, "effect", "half at", bound=bound),
    )


def _as_fast(other: str, results: StudyResults) -> Finding:
    found = results.difference(other, "effect", "half at")
    return Finding(
        _half_way(results, other, found),
        _alike(found, SIMILAR_STEPS),
        results.p_value(other, "effect", "half at", bound=_nearer(found, SIMILAR_STEPS)),
    )


def _below_sac(results: StudyResults) -> Finding:
    found = {method: results.difference("sac", method) for method in DISCRETE}
    return Finding(
        f"SAC's mean score is {_mean(results, 'sac')}{_few(results, 'sac')}, above the others' by {_by_method(found)}",
        _all_above(found.values()),
        max(results.p_value("sac", method) for method in DISCRETE),
    )


def _reached(method: str, results: StudyResults) -> Finding:
    highest, scores = results.curves(method).max(), results.scores(method)
    reached, runs = int((highest > TOP_STEP - SAME_RETURN).sum()), len(highest)
    words = (
        f"{reached} of {runs} runs reach {TOP_STEP} in an evaluation, {(scores > TOP_STEP - SAME_RETURN).sum()} in all of the last "
        f"five; the highest mean of an evaluation is {highest.max():.1f}"
    )
    if reached:
        return Finding(words, SUPPORTED)
    excluded = 3 / runs < SHARE_THAT_MATTERS
    return Finding(f"{words}; so the share is below {3 / runs:.0%}", CONTRADICTED if excluded else UNDECIDED)


def _spread_like_sac(results: StudyResults) -> Finding:
    found = results.difference("effect", "sac", "spread")
    spreads = f"{results.spread('effect')} against {results.spread('sac')}{_few(results, 'sac')}"
    return Finding(
        f"of the scores: {spreads}: difference {found}",
        _alike(found, ONE_STEP),
        results.p_value("effect", "sac", "spread", bound=_nearer(found, ONE_STEP)),
    )


def _others_spread_more(results: StudyResults) -> Finding:
    others = ("uniform", "random")
    found = {method: results.difference(method, "effect", "spread") for method in others}
    return Finding(
        f"{results.spread('effect')} with effect; larger by {_by_method(found)}; runs that all stay low spread little",
        _all_above(found.values()),
        max(results.p_value(method, "effect", "spread") for method in others),
    )


def _parameters(results: StudyResults) -> Finding:
    runs = results.runs.groupby("method").first()
    times = {name: runs[f"parameters_{name}"] for name in ("as_published", "deciding", "trained")}
    published, deciding, trained = (of["sac"] / of["uniform"] for of in times.values())
    sac, dqn = times["as_published"]["sac"], times["as_published"]["uniform"]
    holds = any(round(ratio) == PAPER_RATIO for ratio in (deciding, trained))
    return Finding(
        f"{sac:,.0f} and {dqn:,.0f} come out, {published:.0f} times, if SAC's critics are counted twice and of DQN's networks one. "
        f"Counted alike: the network that chooses the action {deciding:.0f} times, all that are trained {trained:.0f} times",
        SUPPORTED if holds else CONTRADICTED,
    )


# Figures in words


def _two(found: Estimate) -> str:
    return f"{found.value:.2f}" + ("" if np.isnan(found.low) else f" [{found.low:.2f}, {found.high:.2f}]")


def _mean(results: StudyResults, method: str) -> str:
    return f"{results.scores(method).mean():.1f}"


def _half_way(results: StudyResults, other: str, found: Estimate) -> str:
    interval = "" if np.isnan(found.low) else f" [{found.low:,.0f}, {found.high:,.0f}]"
    rise = f"half of the rise takes {_risen(results, 'effect')}, {_risen(results, other)}"
    return f"{rise}: difference in training {found.value:,.0f}{interval} steps"


def _risen(results: StudyResults, method: str) -> str:
    shift = results.shift(method)
    counted = f" (and {shift:,} samples)" if shift else ""
    return f"{results.steps_to_half(method).value:,.0f} steps{counted} with {method}"


def _by_method(found: dict[str, Estimate]) -> str:
    return ", ".join(f"{difference} ({method})" for method, difference in found.items())


def _few(results: StudyResults, method: str) -> str:
    seeds = len(results.scores(method))
    return f" ({seeds} seeds are too few for an interval)" if seeds < FEWEST_SEEDS else ""


def _seeds(results: StudyResults, methods: tuple[str, ...]) -> str:
    return ", ".join(f"{len(results.scores(method))} {method}" for method in methods)


# Why two worlds differ: what was measured in both


def _of_trapped(methods: tuple[str, ...], tumbling: StudyResults, plane: StudyResults) -> str:
    """Say how often the greedy agents jump from within the trap before a riser, and how often such a jump frees the cube."""
    tables = plane.trapped(), tumbling.trapped()
    caught, free = (_in_both(tables, column, methods, _percent) for column in ("in the trap", "free"))
    return f"Trained agents jump from within 3 cm of a riser in {caught}. Such a jump frees the cube in {free}."


def _of_the_order(other: str, tumbling: StudyResults, plane: StudyResults) -> str:
    methods = ("effect", other)
    lost = _in_both((plane.accounts(), tumbling.accounts()), "lost", methods, lambda lost: f"{-lost + 0:.1f}")
    return f"{_of_trapped(methods, tumbling, plane)} Falls cost an episode {lost} steps."


def _of_sac(tumbling: StudyResults, plane: StudyResults) -> str:
    stuck = [(study.ends().query("method == 'sac'")["end"] == "stuck").mean() for study in (plane, tumbling)]
    return (
        f"SAC scores {_mean(plane, 'sac')} in the plane, {_mean(tumbling, 'sac')} in 3-D. Its greedy episodes are stuck at the end in "
        f"{stuck[0]:.0%} in the plane, {stuck[1]:.0%} in 3-D."
    )


def _of_the_level(methods: tuple[str, ...], tumbling: StudyResults, plane: StudyResults) -> str:
    """Say what else differs where no cause was isolated."""
    means = [f"{_mean(plane, method)} and {_mean(tumbling, method)} ({method})" for method in methods]
    return f"No cause was isolated. The mean scores in the plane and in 3-D are {', '.join(means)}."


def _in_both(
    tables: tuple[pd.DataFrame, pd.DataFrame], column: str, methods: tuple[str, ...], words: Callable[[float], str]
) -> str:
    flat, deep = (table.set_index("method")[column] for table in tables)
    return "; ".join(f"{words(flat[name])} in the plane and {words(deep[name])} in 3-D ({name})" for name in methods)


def _percent(share: float) -> str:
    return "none" if np.isnan(share) else f"{share:.0%}"


_CLAIMS = (
    Claim(
        "Effect-based prototypes achieve the highest mean return of the three discrete methods: higher than uniform ones.",
        ("effect", "uniform"),
        partial(_higher_return, "uniform"),
        partial(_of_the_order, "uniform"),
    ),
    Claim(
        "... and higher than random ones, which fail to reach the same average reward.",
        ("effect", "random"),
        partial(_higher_return, "random"),
        partial(_of_the_order, "random"),
    ),
    Claim(
        "Uniform prototypes are close in average reward (within one step).",
        ("effect", "uniform"),
        partial(_close, "uniform"),
        partial(_of_the_order, "uniform"),
    ),
    Claim(
        "Effect-based prototypes outperform both in maximum reward.",
        DISCRETE,
        _higher_maximum,
        partial(_of_the_order, "uniform"),
    ),
    Claim(
        "Uniform prototypes converge way slower (by more than 2,000 steps).",
        ("effect", "uniform"),
        partial(_later, "uniform", SIMILAR_STEPS),
        partial(_of_the_level, ("effect", "uniform")),
    ),
    Claim(
        "Random prototypes rise to their maximum similarly fast (section 4; within 2,000 steps).",
        ("effect", "random"),
        partial(_as_fast, "random"),
        partial(_of_the_level, ("effect", "random")),
    ),
    Claim(
        "Effect-based prototypes outperform random ones in convergence speed (abstract, figure 4).",
        ("effect", "random"),
        partial(_later, "random", 0.0),
        partial(_of_the_level, ("effect", "random")),
    ),
    Claim("All discrete methods fall short of SAC.", (*DISCRETE, "sac"), _below_sac, _of_sac),
    Claim("SAC's highest return is 15.", ("sac",), partial(_reached, "sac"), _of_sac),
    Claim(
        "Some runs with effect-based prototypes achieve the maximal performance.",
        ("effect",),
        partial(_reached, "effect"),
        partial(_of_trapped, ("effect",)),
    ),
    Claim(
        "The effect-based standard deviation is similar to SAC's (within one step).",
        ("effect", "sac"),
        _spread_like_sac,
        partial(_of_the_level, ("effect", "sac")),
    ),
    Claim(
        "The other methods fail to be as robust: their standard deviation is larger.",
        DISCRETE,
        _others_spread_more,
        partial(_of_the_level, DISCRETE),
    ),
    Claim(f"SAC has {PAPER_RATIO} times as many parameters as DQN.", ("uniform", "sac"), _parameters),
)
