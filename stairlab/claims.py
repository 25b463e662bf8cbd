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
SIMILAR_SPREAD = 1.0
""" "Similar standard deviation" is read as: within one step of the stairs """
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
    """What the paper says, the methods that it is about, how to judge it, and why two worlds may differ on it."""

    says: str
    methods: tuple[str, ...]
    judge: Callable[[StudyResults], Finding]
    why: str = ""


def paper_claims(results: StudyResults) -> pd.DataFrame:
    """Set the claims of the paper's results section (and its abstract's) beside what a study finds, a row for each sentence.

    A claim of a difference is supported if the 95 % bootstrap interval over seeds lies wholly on the claimed side, and contradicted
    if it lies on the other. A claim of likeness is supported if the interval lies within a margin, and contradicted if it lies beyond:
    2,000 training steps for "similarly fast" (and beyond for "way slower"), one step of the stairs for a "similar" standard
    deviation. Else, and with five seeds or fewer, it is undecided. "Some runs" is supported by one such run; that none was seen
    contradicts it only where a share of a tenth can be excluded. Sentences about the same difference share a row.

    Parameters
    ----------
    results : StudyResults
        The study.

    Returns
    -------
    pandas.DataFrame
        "the paper says", "we find", "verdict" ("supported", "contradicted", "undecided"; for a quick study "quick: says nothing"), "p"
        (two-sided, by the bootstrap; NaN where nothing is tested) and "p (Holm)", which allows for the number of rows. Claims about
        methods that the study lacks are left out.
    """
    rows = [(claim.says, *claim.judge(results)) for claim in _CLAIMS if set(claim.methods) <= set(results.methods)]
    table = pd.DataFrame(rows, columns=["the paper says", "we find", "verdict", "p"])
    table["p (Holm)"] = holm(table["p"].to_numpy(dtype=float))
    return table.assign(verdict=QUICK_VERDICT) if results.quick else table


def compare_claims(tumbling: StudyResults, plane: StudyResults) -> pd.DataFrame:
    """Judge the claims in three dimensions, with what the plane says beside it.

    Parameters
    ----------
    tumbling, plane : StudyResults
        The two studies. The verdict is about the first: the task is made of jumps from treads, and there the plane is not faithful.

    Returns
    -------
    pandas.DataFrame
        As ``paper_claims`` of the first, with "in the plane", "verdict in the plane" (empty where that study lacks a method), and
        "why they differ" where the two verdicts do.
    """
    table, other = paper_claims(tumbling), paper_claims(plane).set_index("the paper says")
    says = table["the paper says"]
    for column, name in (("in the plane", "we find"), ("verdict in the plane", "verdict")):
        table[column] = [other[name].get(claim, "") for claim in says]
    differs = (table["verdict in the plane"] != "") & (table["verdict"] != table["verdict in the plane"])
    why = {claim.says: claim.why for claim in _CLAIMS}
    table["why they differ"] = [why[claim] if there else "" for claim, there in zip(says, differs, strict=True)]
    return table


def _above(found: Estimate, bound: float = 0.0) -> str:
    """Judge the claim that a difference is above a bound."""
    return SUPPORTED if found.low > bound else CONTRADICTED if found.high < bound else UNDECIDED


def _alike(found: Estimate, margin: float) -> str:
    """Judge the claim that a difference is no larger than a margin."""
    if -margin <= found.low and found.high <= margin:
        return SUPPORTED
    return CONTRADICTED if found.low > margin or found.high < -margin else UNDECIDED


def _all_above(found: Iterable[Estimate]) -> str:
    """Judge the claim that each of several differences is above 0."""
    verdicts = [_above(difference) for difference in found]
    return next((verdict for verdict in (CONTRADICTED, UNDECIDED) if verdict in verdicts), SUPPORTED)


# How each claim is judged, in the order of the table at the end.


def _higher_return(other: str, results: StudyResults) -> Finding:
    found = results.difference("effect", other)
    better = results.probability_of_improvement("effect", other)
    highest = [results.curves(method).mean(axis=1).max() for method in ("effect", other)]
    return Finding(
        f"mean score {results.scores('effect').mean():.1f} against {results.scores(other).mean():.1f}: difference {found}; a run "
        f"of the first beats one of the second with probability {_two(better)}; the mean curves reach at most {highest[0]:.1f} "
        f"and {highest[1]:.1f}",
        _above(found),
        results.difference_p("effect", other),
    )


def _later(other: str, bound: float, results: StudyResults) -> Finding:
    found = results.half_step_difference(other, "effect")
    return Finding(
        f"half of the rise takes {_risen(results, 'effect')}, {_risen(results, other)}: difference in training {_steps(found)}",
        _above(found, bound),
        results.half_step_p(other, "effect", bound),
    )


def _below_sac(results: StudyResults) -> Finding:
    found = {method: results.difference("sac", method) for method in DISCRETE}
    sac = f"SAC's mean score is {results.scores('sac').mean():.1f}{_few(results, 'sac')}"
    return Finding(
        f"{sac}, above the others' by {_by_method(found)}",
        _all_above(found.values()),
        max(results.difference_p("sac", method) for method in DISCRETE),
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
    found = results.spread_difference("effect", "sac")
    spreads = f"{results.spread('effect')} against {results.spread('sac')}{_few(results, 'sac')}"
    return Finding(f"of the scores: {spreads}: difference {found}", _alike(found, SIMILAR_SPREAD))


def _others_spread_more(results: StudyResults) -> Finding:
    found = {method: results.spread_difference(method, "effect") for method in ("uniform", "random")}
    return Finding(
        f"{results.spread('effect')} with effect; larger by {_by_method(found)}; runs that all stay low spread little",
        _all_above(found.values()),
        max(results.spread_p(method, "effect") for method in ("uniform", "random")),
    )


def _parameters(results: StudyResults) -> Finding:
    runs = results.runs.groupby("method").first()
    times = {name: runs[f"parameters_{name}"] for name in ("as_published", "deciding", "trained")}
    published, deciding, trained = (of["sac"] / of["uniform"] for of in times.values())
    sac, dqn = times["as_published"]["sac"], times["as_published"]["uniform"]
    return Finding(
        f"{sac:,.0f} and {dqn:,.0f} come out, {published:.0f} times, if SAC's critics are counted twice and of DQN's networks one. "
        f"Counted alike: the network that chooses the action {deciding:.0f} times, all that are trained {trained:.0f} times",
        CONTRADICTED,
    )


# Figures in words


def _two(found: Estimate) -> str:
    return f"{found.value:.2f}" + ("" if np.isnan(found.low) else f" [{found.low:.2f}, {found.high:.2f}]")


def _steps(found: Estimate) -> str:
    interval = "" if np.isnan(found.low) else f" [{found.low:,.0f}, {found.high:,.0f}]"
    return f"{found.value:,.0f}{interval} steps"


def _risen(results: StudyResults, method: str) -> str:
    shift = results.shift(method)
    counted = f" (and {shift:,} samples)" if shift else ""
    return f"{results.steps_to_half(method).value:,.0f} steps{counted} with {method}"


def _by_method(found: dict[str, Estimate]) -> str:
    return ", ".join(f"{difference} ({method})" for method, difference in found.items())


def _few(results: StudyResults, method: str) -> str:
    seeds = len(results.scores(method))
    return f" ({seeds} seeds are too few for an interval)" if seeds < FEWEST_SEEDS else ""


_TRAPPED = (
    "In the plane most cubes lie in the trap before a riser, and only the grid's motion at 89 degrees leads out of it. In three "
    "dimensions cubes land turned and aside, most lie clear of the riser, and the grid's flat, strong motions throw them off."
)

_CLAIMS = (
    Claim(
        'Effect-based prototypes achieve the highest mean return and a higher maximum than uniform ones, which are "close in average '
        'reward".',
        ("effect", "uniform"),
        partial(_higher_return, "uniform"),
        _TRAPPED,
    ),
    Claim(
        "Effect-based prototypes achieve a higher mean and maximal return than random ones.",
        ("effect", "random"),
        partial(_higher_return, "random"),
        _TRAPPED,
    ),
    Claim(
        "Uniform prototypes converge way slower (by more than 2,000 steps).",
        ("effect", "uniform"),
        partial(_later, "uniform", SIMILAR_STEPS),
        _TRAPPED,
    ),
    Claim(
        "Effect-based prototypes converge faster than random ones (abstract, figure 4; section 4 calls random ones similarly fast).",
        ("effect", "random"),
        partial(_later, "random", 0.0),
        _TRAPPED,
    ),
    Claim(
        "All discrete methods fall short of SAC.",
        (*DISCRETE, "sac"),
        _below_sac,
        "In the plane SAC is trapped, too: it scores half of what it does in three dimensions.",
    ),
    Claim(
        "SAC's highest return is 15.",
        ("sac",),
        partial(_reached, "sac"),
        "In the plane SAC is trapped, too: it scores half of what it does in three dimensions.",
    ),
    Claim(
        "Some runs with effect-based prototypes achieve the maximal performance.",
        ("effect",),
        partial(_reached, "effect"),
        _TRAPPED,
    ),
    Claim(
        "The effect-based standard deviation is similar to SAC's (within one step).",
        ("effect", "sac"),
        _spread_like_sac,
        "SAC's runs scatter in the plane, where some are trapped.",
    ),
    Claim(
        "The other methods fail to be as robust: their standard deviation is larger.",
        DISCRETE,
        _others_spread_more,
        "In the plane random sets all stay low, and so scatter little.",
    ),
    Claim("SAC has 85 times as many parameters as DQN.", ("uniform", "sac"), _parameters),
)
