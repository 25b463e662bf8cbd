"""What random rollouts come to in the engine that the authors' launch files start, beside a world's own: lessons 1, 8 and 10."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from stairlab.fidelity import ASIDE, CLOSE, TURNED, TreadMeasures

ENGINE = {
    "within 3 cm of the riser": "37 %",
    "of these, free after one more jump": "51 %",
    "turned by more than 5°": "72 %",
    "more than 5 cm aside": "78 %",
    "a moderate jump climbs": "33 %",
    "highest step, quartiles": "4, 7, 12",
}
""" Of 6,003 jumps in random rollouts on fifteen steps, see ``tread_figures`` """
ENGINE_GAPS = {5: 0.03, 25: 6.8, 50: 71.0, 75: 166.0, 95: 288.0}
""" Quantiles of the gap between foremost corner and riser there: percentage, and gap [mm] """


def tread_figures(measured: TreadMeasures) -> dict[str, str]:
    """Return what rollouts come to, in words.

    Parameters
    ----------
    measured : TreadMeasures
        Of rollouts: ``TreadMeasures.of(roll_out(world))``.

    Returns
    -------
    dict of str to str
        The names are those of ``ENGINE``: all but the last are about the poses from which second and later jumps start.
    """
    flags = measured.gaps < CLOSE, measured.yaws > TURNED, measured.asides > ASIDE
    close, turned, aside = (float(np.mean(flag)) for flag in flags)
    shares = close, measured.freed_share, turned, aside, measured.climb
    tops = ", ".join(f"{top:g}" for top in measured.top_quartiles)
    return dict(zip(ENGINE, [*(f"{100 * share:.0f} %" for share in shares), tops], strict=True))


def beside_engine(measured: Mapping[str, TreadMeasures]) -> pd.DataFrame:
    """Return the figures of the authors' engine and of worlds side by side, a column for each."""
    return pd.DataFrame({"the authors' engine": ENGINE} | {name: tread_figures(one) for name, one in measured.items()})
