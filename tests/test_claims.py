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


def test_the_claim_of_85_times_as_many_parameters_is_taken_apart():
    results = made_up({"uniform": LOW, "sac": [1.0]})
    _, finds, found = paper_claims(results).set_index("the paper says").filter(like="85", axis=0).reset_index().iloc[0]
    assert found == "holds not"
    assert "475,146 against 5,520" in finds
    assert "12 times" in finds
    assert "37 times" in finds


def test_some_runs_reach_the_highest_return_or_none_does():
    assert verdict(made_up({"effect": [3.0, 15.0]}), "Some runs") == "holds"
    assert verdict(made_up({"effect": [3.0, 14.0]}), "Some runs") == "holds not"


def test_claims_about_methods_that_are_not_there_are_left_out():
    assert paper_claims(made_up({"fixed": LOW})).empty
    assert not any("SAC" in says for says in verdicts(made_up({"effect": HIGH, "uniform": LOW})))
