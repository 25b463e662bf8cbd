"""The claims of the paper's results section (section 4), each set beside what a study finds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from stairlab.results import FEWEST_SEEDS, SAME_RETURN, TOP_STEP, Estimate, StudyResults

SIMILAR_STEPS = 2000
""" "Similarly fast" is read as: within as many steps as the effect-based sets had samples """
CLOSE_RETURN = 1.0
""" "Close in average reward" is read as: within one step of the stairs """
SIMILAR_SPREAD = 1.0
""" "Similar standard deviation" is read as: within one step of the stairs """

Claim = tuple[str, str, str]


def paper_claims(results: StudyResults) -> pd.DataFrame:
    """Set the claims of the paper's results section beside what a study finds.

    A claim of a difference holds if the 95 % bootstrap interval over seeds lies above 0, and does not hold if it lies below. A claim
    of likeness holds if the interval lies within the margin, and does not hold if it lies beyond it:
    2,000 steps for "similarly fast" (what the set's samples cost), one step of the stairs for "close" and for a "similar"
    standard deviation. Else, and with five seeds or fewer, it is not decided.

    Parameters
    ----------
    results : StudyResults
        The study.

    Returns
    -------
    pandas.DataFrame
        "the paper says", "we find", "verdict" ("holds", "holds not", "not decided"). Claims about methods that the study lacks are
        left out.
    """
    rows = [claim(results) for claim, needed in _CLAIMS.items() if set(needed) <= set(results.methods)]
    return pd.DataFrame(rows, columns=["the paper says", "we find", "verdict"])


def _differs(found: Estimate) -> str:
    """Judge the claim that a difference is above 0."""
    return "holds" if found.low > 0 else "holds not" if found.high < 0 else "not decided"


def _is_like(found: Estimate, margin: float) -> str:
    """Judge the claim that a difference is no larger than a margin."""
    if -margin <= found.low and found.high <= margin:
        return "holds"
    return "holds not" if found.low > margin or found.high < -margin else "not decided"


def _higher_than(other: str, words: str) -> Callable[[StudyResults], Claim]:
    def claim(results: StudyResults) -> Claim:
        found = results.difference("effect", other)
        better = results.probability_of_improvement("effect", other)
        means = f"mean score {results.scores('effect').mean():.1f} against {results.scores(other).mean():.1f}"
        return (
            f"Effect-based prototypes reach a higher mean return than {words} ones.",
            f"{means}: difference {found}; a run of the first beats one of the second with probability {_two(better)}",
            _differs(found),
        )

    return claim


def _faster_than_uniform(results: StudyResults) -> Claim:
    found = results.half_step_difference("uniform", "effect")
    return (
        "Uniform prototypes converge way slower.",
        f"half of the highest mean after {results.steps_to_half('effect').value:,.0f} steps with effect-based (their 2,000 samples "
        f"counted), {results.steps_to_half('uniform').value:,.0f} with uniform ones: difference {_steps(found)}",
        _differs(found),
    )


def _random_as_fast(results: StudyResults) -> Claim:
    found = results.half_step_difference("random", "effect")
    return (
        "Random prototypes rise to their maximum similarly fast.",
        f"half of the highest mean after {results.steps_to_half('random').value:,.0f} steps with random, "
        f"{results.steps_to_half('effect').value:,.0f} with effect-based ones: difference {_steps(found)}",
        _is_like(found, SIMILAR_STEPS),
    )


def _uniform_close(results: StudyResults) -> Claim:
    found = results.difference("effect", "uniform")
    return (
        "Uniform prototypes are close in average return.",
        f"difference of the mean scores {found}",
        _is_like(found, CLOSE_RETURN),
    )


def _below_sac(results: StudyResults) -> Claim:
    others = [method for method in ("effect", "uniform", "random") if method in results.methods]
    best = max(others, key=lambda method: results.scores(method).mean())
    found = results.difference("sac", best)
    return (
        "All discrete methods fall short of SAC.",
        f"mean score {results.scores('sac').mean():.1f} with SAC, {results.scores(best).mean():.1f} with the best of the three "
        f"({best}): difference {found}{_few(results, 'sac')}",
        _differs(found),
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
        "The standard deviation is similar to SAC's.",
        f"standard deviation of the scores {results.spread('effect').value:.1f} with effect-based prototypes, "
        f"{results.spread('sac').value:.1f} with SAC: difference {found}{_few(results, 'sac')}",
        _is_like(found, SIMILAR_SPREAD),
    )


def _less_spread_than(other: str) -> Callable[[StudyResults], Claim]:
    def claim(results: StudyResults) -> Claim:
        found = results.spread_difference(other, "effect")
        return (
            f"The standard deviation is smaller than with {other} prototypes.",
            f"{results.spread('effect').value:.1f} against {results.spread(other).value:.1f}: difference {found}",
            _differs(found),
        )

    return claim


def _fewer_parameters(results: StudyResults) -> Claim:
    dqn, sac = (results._of("runs", method).iloc[0] for method in ("uniform", "sac"))
    ratios = {
        name: sac[f"parameters_{name}"] / dqn[f"parameters_{name}"] for name in ("as_published", "deciding", "trained")
    }
    return (
        "SAC has 85 times as many parameters (475,146 against 5,520).",
        f"{sac['parameters_as_published']:,.0f} against {dqn['parameters_as_published']:,.0f} only if SAC's critics are counted "
        f"twice; the networks that choose actions {ratios['deciding']:.0f} times, all that are trained {ratios['trained']:.0f} "
        f"times",
        "holds not",
    )


def _some_reach_the_maximum(results: StudyResults) -> Claim:
    highest = results.curves("effect").max()
    reached = highest > TOP_STEP - SAME_RETURN
    stayed = (results.scores("effect") > TOP_STEP - SAME_RETURN).sum()
    return (
        "Some runs with effect-based prototypes reach the highest return.",
        f"{reached.sum()} of {len(highest)} reach {TOP_STEP} in an evaluation, {stayed} of them in each of the last five; the highest "
        f"return of a run is {highest.max():.1f}",
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
    _higher_than("uniform", "uniform"): ("effect", "uniform"),
    _higher_than("random", "random"): ("effect", "random"),
    _faster_than_uniform: ("effect", "uniform"),
    _random_as_fast: ("effect", "random"),
    _uniform_close: ("effect", "uniform"),
    _below_sac: ("effect", "sac"),
    _sac_solves: ("sac",),
    _spread_like_sac: ("effect", "sac"),
    _less_spread_than("uniform"): ("effect", "uniform"),
    _less_spread_than("random"): ("effect", "random"),
    _fewer_parameters: ("uniform", "sac"),
    _some_reach_the_maximum: ("effect",),
}
