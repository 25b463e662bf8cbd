"""When a claim of the paper holds, holds not, or is not decided: on made-up studies with a known answer."""

import numpy as np
from small_study import made_up

from stairlab.claims import paper_claims

rng = np.random.default_rng(0)
HIGH, LOW = rng.normal(10, 1, 20), rng.normal(5, 1, 20)


def verdicts(results):
    return dict(paper_claims(results)[["the paper says", "verdict"]].to_numpy())


def verdict(results, *words):
    (found,) = [value for says, value in verdicts(results).items() if all(word in says for word in words)]
    return found


def test_a_clear_difference_holds_its_opposite_does_not_and_too_few_seeds_decide_nothing():
    high_return = ("higher mean return than uniform",)
    assert verdict(made_up({"effect": HIGH, "uniform": LOW}), *high_return) == "holds"
    assert verdict(made_up({"effect": LOW, "uniform": HIGH}), *high_return) == "holds not"
    assert verdict(made_up({"effect": HIGH, "uniform": HIGH[::-1]}), *high_return) == "not decided"
    assert verdict(made_up({"effect": HIGH[:5], "uniform": LOW[:5]}), *high_return) == "not decided"


def test_likeness_holds_within_a_margin_and_not_beyond_it():
    close = ("Uniform", "close in average return")
    same = made_up({"effect": HIGH, "uniform": HIGH[::-1] + 0.1})
    assert verdict(same, *close) == "holds"
    assert verdict(made_up({"effect": HIGH, "uniform": LOW}), *close) == "holds not"
    wide = np.linspace(0, 15, 6)
    assert verdict(made_up({"effect": wide, "uniform": wide}), *close) == "not decided"


def test_the_published_numbers_of_parameters_come_out_and_85_times_does_not():
    results = made_up({"uniform": LOW, "sac": [1.0]})
    assert verdict(results, "475,146") == "holds"
    assert verdict(results, "85 times as large") == "holds not"
    (finds,) = paper_claims(results).set_index("the paper says").filter(like="as large", axis=0)["we find"]
    assert "12 times" in finds
    assert "37 times" in finds


def test_all_methods_fall_short_of_sac_only_if_each_does():
    low = {"effect": LOW, "uniform": LOW, "random": LOW}
    assert verdict(made_up(low | {"sac": HIGH}), "fall short") == "holds"
    assert verdict(made_up(low | {"uniform": HIGH + 5, "sac": HIGH}), "fall short") == "holds not"
    assert verdict(made_up(low | {"sac": HIGH[:5]}), "fall short") == "not decided"


def test_robustness_is_the_spread_of_the_scores():
    narrow, wide = np.linspace(9, 10, 20), np.linspace(0, 15, 20)
    robust = made_up({"effect": narrow, "uniform": wide, "random": wide, "sac": narrow})
    assert verdict(robust, "similar to SAC's") == "holds"
    assert verdict(robust, "not as robust") == "holds"
    turned = made_up({"effect": wide, "uniform": narrow, "random": wide, "sac": narrow})
    assert verdict(turned, "similar to SAC's") == "holds not"
    assert verdict(turned, "not as robust") == "holds not"


def test_speed_is_compared_in_training_steps():
    results = made_up({"effect": HIGH, "uniform": LOW, "random": LOW}, samples={"effect": 2000})
    assert verdict(results, "way slower") == "holds not"
    assert verdict(results, "similarly fast") == "holds"
    assert verdict(results, "faster than random") == "not decided"


def test_a_quick_study_says_nothing():
    assert set(paper_claims(made_up({"effect": HIGH, "uniform": LOW}, quick=True))["verdict"]) == {
        "quick: says nothing"
    }


def test_some_runs_reach_the_highest_return_or_none_does():
    assert verdict(made_up({"effect": [3.0, 15.0]}), "Some runs") == "holds"
    assert verdict(made_up({"effect": [3.0, 14.0]}), "Some runs") == "holds not"


def test_claims_about_methods_that_are_not_there_are_left_out():
    assert paper_claims(made_up({"fixed": LOW})).empty
    assert not any("SAC" in says for says in verdicts(made_up({"effect": HIGH, "uniform": LOW})))
