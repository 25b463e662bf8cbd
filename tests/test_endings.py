"""How runs end: on made-up episodes with a known answer."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from small_study import made_up


def test_episodes_end_on_the_top_or_stuck_or_else():
    results = made_up({"effect": [15.0, 3.0, 3.0]})
    moving = (results.episodes["seed"] == 2) & (results.episodes["jump"] == 6)
    results.episodes.loc[moving, "y"] += 0.01
    assert results.ends()["end"].tolist() == ["top", "stuck", "other"]
    assert results.ends()["to riser"][1] == pytest.approx(1.4 - 1.3 - 0.05)


def test_a_way_out_is_searched_from_where_the_agents_own_jumps_lead():
    # 100 N at 1 degree lead to the first riser; from there only a jump that is steep enough could climb
    stuck = made_up({"effect": [3.0, 3.0]})
    stuck.episodes[["magnitude", "angle"]] = 100.0, 1.0
    stuck.motions[["magnitude", "angle"]] = [[100.0, 1.0], [60.0, 1.0], [100.0, 1.0], [500.0, 89.0]]
    table = stuck.ways_out()
    assert table[["method", "seed"]].to_numpy().tolist() == [["effect", 0], ["effect", 1]]
    assert table["jumps"][0] == np.inf
    assert np.isfinite(table["jumps"][1])


def test_each_run_with_a_set_has_its_trap_and_its_own_score():
    results = made_up({"uniform": [2.0, 1.0], "sac": [7.0]})
    traps = results.traps()
    assert traps[["method", "seed", "score"]].to_numpy().tolist() == [["uniform", 0, 2.0], ["uniform", 1, 1.0]]
    assert (traps["steepest"] == 80).all()
    assert traps["trap"][0] == traps["trap"][1] > 0


def test_a_study_of_sac_alone_has_neither_traps_nor_ways_out():
    results = replace(made_up({"sac": [7.0]}), motions=pd.DataFrame(columns=["method", "seed"]))
    assert results.traps().empty
    assert results.ways_out().empty
    assert results.ends()["end"].tolist() == ["stuck"]
