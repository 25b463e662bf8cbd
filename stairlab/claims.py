"""The claims of the paper's results section (section 4), each set beside what a study finds."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from stairlab.estimates import FEWEST_SEEDS, Estimate
from stairlab.results import SAME_RETURN, TOP_STEP, StudyResults

SIMILAR_STEPS = 2000
""" "Similarly fast" is read as: within as many training steps as the effect-based sets have samples; "way slower" as: by more """
CLOSE_RETURN = 1.0
""" "Close in average reward" is read as: within one step of the stairs """
SIMILAR_SPREAD = 1.0
""" "Similar standard deviation" is read as: within one step of the stairs """
DISCRETE = ("effect", "uniform", "random")
""" The paper's discrete methods """


class Claim(NamedTuple):
    """What the paper says, the methods that it is about, and how to judge it: from a study to what we find and the verdict."""

    says: str
    methods: tuple[str, ...]
    judge: Callable[[StudyResults], tuple[str, str]]


def paper_claims(results: StudyResults) -> pd.DataFrame:
    """Set the claims of the paper's results section (and its abstract's) beside what a study finds.

    A claim of a difference holds if the 95 % bootstrap interval over seeds lies above 0, and holds not if it lies below. A claim of
    likeness holds if the interval lies within a margin, and holds not if it lies beyond it: 2,000 training steps for "similarly fast"
    (and beyond it for "way slower"), one step of the stairs for "close" and for a "similar" standard deviation. Else, and with five
    seeds or fewer, it is not decided. What needs no statistics (a return that was reached, a number of parameters) is counted. The
    intervals are not corrected for the number of claims.

    Parameters
    ----------
    results : StudyResults
        The study.

    Returns
    -------
    pandas.DataFrame
        "the paper says", "we find", "verdict" ("holds", "holds not", "not decided"; for a quick study "quick: says nothing").
        Claims about methods that the study lacks are left out.
    """
    rows = [(claim.says, *claim.judge(results)) for claim in _CLAIMS if set(claim.methods) <= set(results.methods)]
    table = pd.DataFrame(rows, columns=["the paper says", "we find", "verdict"])
    return table.assign(verdict="quick: says nothing") if results.quick else table


def _is_above(found: Estimate, bound: float = 0.0) -> str:
    """Judge the claim that a difference is above a bound."""
    return "holds" if found.low > bound else "holds not" if found.high < bound else "not decided"


def _is_like(found: Estimate, margin: float) -> str:
    """Judge the claim that a difference is no larger than a margin."""
    if -margin <= found.low and found.high <= margin:
        return "holds"
    return "holds not" if found.low > margin or found.high < -margin else "not decided"


def _are_above(found: Iterable[Estimate]) -> str:
    """Judge the claim that each of several differences is above 0."""
    verdicts = [_is_above(difference) for difference in found]
    return next((verdict for verdict in ("holds not", "not decided") if verdict in verdicts), "holds")


def _is_true(found: bool) -> str:
    """Judge a claim that needs no statistics."""
    return "holds" if found else "holds not"


# How each claim is judged, in the order of the table at the end.


def _higher_mean(other: str, results: StudyResults) -> tuple[str, str]:
    found = results.difference("effect", other)
    better = results.probability_of_improvement("effect", other)
    return (
        f"mean score {results.scores('effect').mean():.1f} against {results.scores(other).mean():.1f}: difference {found}; a run "
        f"of the first beats one of the second with probability {_two(better)}",
        _is_above(found),
    )


def _higher_maximum(other: str, results: StudyResults) -> tuple[str, str]:
    found = results.highest_mean_difference("effect", other)
    highest = [results.curves(method).mean(axis=1).max() for method in ("effect", other)]
    return f"the mean curve's maximum is {highest[0]:.1f} against {highest[1]:.1f}: difference {found}", _is_above(
        found
    )


def _uniform_close(results: StudyResults) -> tuple[str, str]:
    found = results.difference("effect", "uniform")
    return f"difference of the mean scores {found}", _is_like(found, CLOSE_RETURN)


def _later(other: str, judge: Callable[[Estimate], str], results: StudyResults, both: bool = True) -> tuple[str, str]:
    found = results.half_step_difference(other, "effect")
    risen = f"half of the rise takes {_risen(results, 'effect')}, {_risen(results, other)}: " if both else ""
    return f"{risen}difference in training {_steps(found)}", judge(found)


def _below_sac(results: StudyResults) -> tuple[str, str]:
    found = {method: results.difference("sac", method) for method in DISCRETE}
    sac = f"SAC's mean score is {results.scores('sac').mean():.1f}{_few(results, 'sac')}"
    return f"{sac}, above the others' by {_by_method(found)}", _are_above(found.values())


def _sac_solves(results: StudyResults) -> tuple[str, str]:
    best = results.curves("sac").to_numpy().max()
    return f"its highest evaluation is {best:.1f}", _is_true(best > TOP_STEP - SAME_RETURN)


def _some_reach_the_maximum(results: StudyResults) -> tuple[str, str]:
    highest = results.curves("effect").max()
    reached = highest > TOP_STEP - SAME_RETURN
    stayed = (results.scores("effect") > TOP_STEP - SAME_RETURN).sum()
    return (
        f"{reached.sum()} of {len(highest)} reach {TOP_STEP} in an evaluation, {stayed} in each of the last five; the highest "
        f"return of any run is {highest.max():.1f}",
        _is_true(reached.any()),
    )


def _spread_like_sac(results: StudyResults) -> tuple[str, str]:
    found = results.spread_difference("effect", "sac")
    spreads = f"{results.spread('effect')} against {results.spread('sac')}{_few(results, 'sac')}"
    return f"of the scores: {spreads}: difference {found}", _is_like(found, SIMILAR_SPREAD)


def _others_spread_more(results: StudyResults) -> tuple[str, str]:
    found = {method: results.spread_difference(method, "effect") for method in ("uniform", "random")}
    return (
        f"{results.spread('effect')} with effect; larger by {_by_method(found)}; runs that all stay low spread little",
        _are_above(found.values()),
    )


def _published_parameters(results: StudyResults) -> tuple[str, str]:
    dqn, sac = _parameters(results, "as_published")
    return (
        f"{sac:,.0f} and {dqn:,.0f} come out, {sac / dqn:.0f} times, if SAC's critics are counted twice and its targets once, and of "
        "DQN's two networks one",
        _is_true((sac, dqn) == (475_146, 5520)),
    )


def _honest_parameters(results: StudyResults) -> tuple[str, str]:
    deciding, trained = (sac / dqn for dqn, sac in (_parameters(results, name) for name in ("deciding", "trained")))
    return (
        f"counted alike: the network that chooses the action {deciding:.0f} times, all that are trained {trained:.0f} times",
        "holds not",
    )


def _parameters(results: StudyResults, name: str) -> tuple[float, float]:
    runs = results.runs.groupby("method")[f"parameters_{name}"].first()
    return float(runs["uniform"]), float(runs["sac"])


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


_CLAIMS = (
    *(
        Claim(
            f"Effect-based prototypes reach a higher {what} return than {other} ones.",
            ("effect", other),
            partial(judge, other),
        )
        for what, judge in (("mean", _higher_mean), ("maximal", _higher_maximum))
        for other in ("uniform", "random")
    ),
    Claim("Uniform prototypes are close in average return.", ("effect", "uniform"), _uniform_close),
    Claim(
        "Uniform prototypes converge way slower.",
        ("effect", "uniform"),
        partial(_later, "uniform", partial(_is_above, bound=SIMILAR_STEPS)),
    ),
    Claim(
        "Random prototypes rise to their maximum similarly fast.",
        ("effect", "random"),
        partial(_later, "random", partial(_is_like, margin=SIMILAR_STEPS)),
    ),
    Claim(
        "Effect-based prototypes converge faster than random ones, too (abstract, figure 4; the text says otherwise).",
        ("effect", "random"),
        partial(_later, "random", _is_above, both=False),
    ),
    Claim("All discrete methods fall short of SAC.", (*DISCRETE, "sac"), _below_sac),
    Claim("SAC's highest return is 15.", ("sac",), _sac_solves),
    Claim("Some runs with effect-based prototypes reach the highest return.", ("effect",), _some_reach_the_maximum),
    Claim("The effect-based standard deviation is similar to SAC's.", ("effect", "sac"), _spread_like_sac),
    Claim("The other methods are not as robust: their standard deviation is larger.", DISCRETE, _others_spread_more),
    Claim(
        "SAC has 475,146 parameters, DQN 5,520 with 16 actions: 85 times as many.",
        ("uniform", "sac"),
        _published_parameters,
    ),
    Claim("SAC is 85 times as large.", ("uniform", "sac"), _honest_parameters),
)
