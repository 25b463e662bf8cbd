"""How runs end: on made-up episodes with a known answer."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from small_study import made_up

from stairlab.endings import accounts, ends, thrown_off, trapped
from stairlab.results import load_published_study


def test_episodes_end_on_the_top_or_stuck_or_else():
    results = made_up({"effect": [15.0, 3.0, 3.0]})
    moving = (results.episodes["seed"] == 2) & (results.episodes["jump"] == 6)
    results.episodes.loc[moving, "y"] += 0.01
    assert results.ends()["end"].tolist() == ["top", "stuck", "other"]
    assert results.ends()["to riser"][1] == pytest.approx(1.4 - 1.3 - 0.05)


def test_a_cube_that_leaves_the_map_is_off_and_one_that_tumbles_on_its_step_for_ten_jumps_is_stuck():
    results = made_up({"effect": [3.0, 3.0, 3.0]})
    table = pd.concat([results.episodes, results.episodes.assign(jump=results.episodes["jump"] + 7)])
    table = table.sort_values(["seed", "jump"], kind="stable").assign(
        episode=0, yaw=20.0, x=np.arange(len(table)) / 100
    )
    table.loc[(table["seed"] == 0) & (table["jump"] == 14), "x"] = 2.5
    table.loc[(table["seed"] == 2) & (table["jump"] == 6), "steps"] = 1
    assert ends(table, tumbles=True)["end"].tolist() == ["off", "stuck", "other"]
    reach = 0.05 * (np.cos(np.radians(20)) + np.sin(np.radians(20)))
    assert ends(table, tumbles=True)["to riser"][1] == pytest.approx(1.4 - 1.3 - reach)


def test_tables_of_the_plane_from_before_and_after_it_had_an_x_are_read_alike():
    before = made_up({"effect": [15.0, 3.0]})
    after = replace(before, episodes=before.episodes.assign(method="later", x=0.0, yaw=0.0))
    both = before.joined(replace(after, runs=before.runs.assign(method="later")))
    assert both.ends()["end"].tolist() == ["top", "stuck"] * 2
    assert both.trapped()["method"].tolist() == ["effect", "later"]


def test_trapped_counts_jumps_from_near_a_riser_and_what_becomes_of_them():
    ys, steps = [1.335, 1.335, 1.30, 1.45, 1.735], [2, 2, 2, 3, 3]  # in the trap, still, free, higher, in the trap
    table = pd.DataFrame({"method": "effect", "seed": 0, "episode": 0, "x": 0.0, "y": ys, "yaw": 0.0, "steps": steps})
    (row,) = trapped(table).to_dict("records")
    assert row["jumps"] == 4
    assert row["in the trap"] == 0.5
    assert (row["free"], row["climbs"]) == (0.5, 0.0)
    assert row["climbs anywhere"] == 0.25


def test_an_account_counts_climbs_once_each_however_high_and_what_falls_cost():
    steps, rewards = (
        [2, 2, 5, 4, 0],
        [1.0, 0.0, 1.0, -1.0, -4.0],
    )  # two climbs of 2 and 3 steps, a fall of one, and off the map
    table = pd.DataFrame({"method": "effect", "seed": 0, "episode": 0, "y": 1.0, "steps": steps, "reward": rewards})
    (row,) = accounts(table).to_dict("records")
    assert (row["jumps"], row["climb"], row["steps a climb"]) == (5, 2, 2.5)
    assert (row["lost"], row["return"]) == (-5, -3)


def test_what_is_earned_and_lost_is_the_return():
    table = load_published_study("tumbling").accounts()
    np.testing.assert_allclose(table["climb"] + table["lost"], table["return"], atol=0.01)


def test_who_leaves_the_map_is_counted_by_the_last_motion_and_the_side():
    def episode(seed, angle, x, y):
        rows = {"jump": [1, 2], "angle": [70.0, angle], "x": [0.0, x], "y": [0.5, y], "z": 0.05, "steps": 0, "yaw": 0.0}
        return pd.DataFrame({"method": "effect", "seed": seed, "episode": 0, **rows})

    table = pd.concat(
        [episode(0, 89, 0, -0.5), episode(1, 60, 2.5, 1.0), episode(2, 89, 0, 1.0), episode(3, 89, 0, -0.1)]
    )
    (row,) = thrown_off(table, tumbles=True).to_dict("records")
    assert (row["episodes"], row["off"], row["steep"]) == (4, 0.75, 3 / 8)
    assert row["steep last"] == pytest.approx(2 / 3)
    assert (row["behind"], row["aside"]) == (pytest.approx(2 / 3), pytest.approx(1 / 3))
    (row,) = thrown_off(table.assign(angle=np.nan), tumbles=True).to_dict("records")
    assert np.isnan(row["steep"])


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
