"""The claims of the paper's results section (section 4), each set beside what a study finds."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from stairlab.results import FEWEST_SEEDS, SAME_RETURN, TOP_STEP, Estimate, StudyResults

SIMILAR_STEPS = 2000
""" "Similarly fast" is read as: within as many training steps as the effect-based sets have samples; "way slower" as: by more """
CLOSE_RETURN = 1.0
""" "Close in average reward" is read as: within one step of the stairs """
SIMILAR_SPREAD = 1.0
""" "Similar standard deviation" is read as: within one step of the stairs """
DISCRETE = ("effect", "uniform", "random")
""" The paper's discrete methods """

Claim = tuple[str, str, str]


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
    rows = [claim(results) for claim, needed in _CLAIMS.items() if set(needed) <= set(results.methods)]
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


def _all_of(verdicts: Sequence[str]) -> str:
    """Judge a claim that consists of several."""
    return next((verdict for verdict in ("holds not", "not decided") if verdict in verdicts), "holds")


def _higher_mean_than(other: str) -> Callable[[StudyResults], Claim]:
    def claim(results: StudyResults) -> Claim:
        found = results.difference("effect", other)
        better = results.probability_of_improvement("effect", other)
        return (
            f"Effect-based prototypes reach a higher mean return than {other} ones.",
            f"mean score {results.scores('effect').mean():.1f} against {results.scores(other).mean():.1f}: difference {found}; a run "
            f"of the first beats one of the second with probability {_two(better)}",
            _is_above(found),
        )

    return claim


def _higher_maximum_than(other: str) -> Callable[[StudyResults], Claim]:
    def claim(results: StudyResults) -> Claim:
        found = results.highest_mean_difference("effect", other)
        highest = [results.curves(method).mean(axis=1).max() for method in ("effect", other)]
        return (
            f"Effect-based prototypes reach a higher maximal return than {other} ones.",
            f"the mean curve's maximum is {highest[0]:.1f} against {highest[1]:.1f}: difference {found}",
            _is_above(found),
        )

    return claim


def _risen(results: StudyResults, method: str) -> str:
    shift = results.shift(method)
    counted = f" (and {shift:,} samples)" if shift else ""
    return f"{results.steps_to_half(method).value:,.0f} steps{counted} with {method}"


def _uniform_slower(results: StudyResults) -> Claim:
    found = results.half_step_difference("uniform", "effect")
    return (
        "Uniform prototypes converge way slower.",
        f"half of the rise takes {_risen(results, 'effect')}, {_risen(results, 'uniform')}: difference in training {_steps(found)}",
        _is_above(found, SIMILAR_STEPS),
    )


def _random_as_fast(results: StudyResults) -> Claim:
    found = results.half_step_difference("random", "effect")
    return (
        "Random prototypes rise to their maximum similarly fast.",
        f"half of the rise takes {_risen(results, 'effect')}, {_risen(results, 'random')}: difference in training {_steps(found)}",
        _is_like(found, SIMILAR_STEPS),
    )


def _random_slower(results: StudyResults) -> Claim:
    found = results.half_step_difference("random", "effect")
    return (
        "Effect-based prototypes converge faster than random ones, too (abstract, figure 4; the text says otherwise).",
        f"difference in training {_steps(found)}",
        _is_above(found),
    )


def _uniform_close(results: StudyResults) -> Claim:
    found = results.difference("effect", "uniform")
    return (
        "Uniform prototypes are close in average return.",
        f"difference of the mean scores {found}",
        _is_like(found, CLOSE_RETURN),
    )


def _below_sac(results: StudyResults) -> Claim:
    found = {method: results.difference("sac", method) for method in DISCRETE}
    return (
        "All discrete methods fall short of SAC.",
        f"SAC's mean score is {results.scores('sac').mean():.1f}{_few(results, 'sac')}, above the others' by "
        + ", ".join(f"{difference} ({method})" for method, difference in found.items()),
        _all_of([_is_above(difference) for difference in found.values()]),
    )


def _sac_solves(results: StudyResults) -> Claim:
    best = results.curves("sac").to_numpy().max()
    return (
        "SAC's highest return is 15.",
        f"its highest evaluation is {best:.1f}",
        "holds" if best > TOP_STEP - SAME_RETURN else "holds not",
    )


def _spread_like_sac(results: StudyResults) -> Claim:
    found = results.spread_difference("effect", "sac")
    return (
        "The effect-based standard deviation is similar to SAC's.",
        f"of the scores: {results.spread('effect')} against {results.spread('sac')}{_few(results, 'sac')}: "
        f"difference {found}",
        _is_like(found, SIMILAR_SPREAD),
    )


def _others_spread_more(results: StudyResults) -> Claim:
    found = {method: results.spread_difference(method, "effect") for method in ("uniform", "random")}
    return (
        "The other methods are not as robust: their standard deviation is larger.",
        f"{results.spread('effect')} with effect; larger by "
        + ", ".join(f"{difference} ({method})" for method, difference in found.items())
        + "; runs that all stay low spread little",
        _all_of([_is_above(difference) for difference in found.values()]),
    )


def _published_parameters(results: StudyResults) -> Claim:
    dqn, sac = _parameters(results, "as_published")
    return (
        "SAC has 475,146 parameters, DQN 5,520 with 16 actions: 85 times as many.",
        f"{sac:,.0f} and {dqn:,.0f} come out, {sac / dqn:.0f} times, if SAC's critics are counted twice and its targets once, and of "
        "DQN's two networks one",
        "holds" if (sac, dqn) == (475_146, 5520) else "holds not",
    )


def _honest_parameters(results: StudyResults) -> Claim:
    deciding, trained = (sac / dqn for dqn, sac in (_parameters(results, name) for name in ("deciding", "trained")))
    return (
        "SAC is 85 times as large.",
        f"counted alike: the network that chooses the action {deciding:.0f} times, all that are trained {trained:.0f} times",
        "holds not",
    )


def _parameters(results: StudyResults, name: str) -> tuple[float, float]:
    runs = results.runs.groupby("method")[f"parameters_{name}"].first()
    return float(runs["uniform"]), float(runs["sac"])


def _some_reach_the_maximum(results: StudyResults) -> Claim:
    highest = results.curves("effect").max()
    reached = highest > TOP_STEP - SAME_RETURN
    stayed = (results.scores("effect") > TOP_STEP - SAME_RETURN).sum()
    return (
        "Some runs with effect-based prototypes reach the highest return.",
        f"{reached.sum()} of {len(highest)} reach {TOP_STEP} in an evaluation, {stayed} in each of the last five; the highest "
        f"return of any run is {highest.max():.1f}",
        "holds" if reached.any() else "holds not",
    )


def _few(results: StudyResults, method: str) -> str:
    seeds = len(results.scores(method))
    return f" ({seeds} seeds are too few for an interval)" if seeds < FEWEST_SEEDS else ""


def _two(found: Estimate) -> str:
    return f"{found.value:.2f}" + ("" if np.isnan(found.low) else f" [{found.low:.2f}, {found.high:.2f}]")


def _steps(found: Estimate) -> str:
    interval = "" if np.isnan(found.low) else f" [{found.low:,.0f}, {found.high:,.0f}]"
    return f"{found.value:,.0f}{interval} steps"


_CLAIMS: dict[Callable[[StudyResults], Claim], tuple[str, ...]] = {
    _higher_mean_than("uniform"): ("effect", "uniform"),
    _higher_mean_than("random"): ("effect", "random"),
    _higher_maximum_than("uniform"): ("effect", "uniform"),
    _higher_maximum_than("random"): ("effect", "random"),
    _uniform_close: ("effect", "uniform"),
    _uniform_slower: ("effect", "uniform"),
    _random_as_fast: ("effect", "random"),
    _random_slower: ("effect", "random"),
    _below_sac: (*DISCRETE, "sac"),
    _sac_solves: ("sac",),
    _some_reach_the_maximum: ("effect",),
    _spread_like_sac: ("effect", "sac"),
    _others_spread_more: DISCRETE,
    _published_parameters: ("uniform", "sac"),
    _honest_parameters: ("uniform", "sac"),
}
