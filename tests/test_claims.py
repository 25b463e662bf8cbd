"""When a claim of the paper is supported, contradicted or undecided: on made-up studies with a known answer."""

import numpy as np
import pytest
from small_study import made_up

from stairlab.claims import compare_claims, paper_claims
from stairlab.results import load_published_study

rng = np.random.default_rng(0)
HIGH, LOW = rng.normal(10, 1, 20), rng.normal(5, 1, 20)
RETURN = ("highest mean return", "uniform")
SETS = {"effect": HIGH, "uniform": LOW, "random": LOW}


def verdicts(results):
    return dict(paper_claims(results)[["the paper says", "verdict"]].to_numpy())


def verdict(results, *words):
    (found,) = [value for says, value in verdicts(results).items() if all(word in says for word in words)]
    return found


def test_a_clear_difference_is_supported_its_opposite_contradicted_and_too_few_seeds_decide_nothing():
    assert verdict(made_up({"effect": HIGH, "uniform": LOW}), *RETURN) == "supported"
    assert verdict(made_up({"effect": LOW, "uniform": HIGH}), *RETURN) == "contradicted"
    assert verdict(made_up({"effect": HIGH, "uniform": HIGH[::-1]}), *RETURN) == "undecided"
    assert verdict(made_up({"effect": HIGH[:5], "uniform": LOW[:5]}), *RETURN) == "undecided"


def test_no_two_rows_are_about_the_same_difference():
    table = paper_claims(made_up({"effect": HIGH, "uniform": LOW, "random": LOW - 1, "sac": HIGH}))
    assert len(table) == table["the paper says"].nunique() == 13
    above = ~table["the paper says"].str.contains("close")
    found = table.loc[above & table["we find"].str.contains("mean score .* against"), "we find"]
    assert len(found) == found.nunique() == 2  # uniform, random


def test_sac_is_85_times_as_large_only_if_its_critics_are_counted_twice():
    results = made_up({"uniform": LOW, "sac": [1.0]})
    assert verdict(results, "85 times") == "contradicted"
    (finds,) = paper_claims(results).set_index("the paper says").filter(like="85 times", axis=0)["we find"]
    for words in ("475,146 and 5,520", "86 times", "12 times", "37 times"):
        assert words in finds


def test_all_methods_fall_short_of_sac_only_if_each_does():
    low = {"effect": LOW, "uniform": LOW, "random": LOW}
    assert verdict(made_up(low | {"sac": HIGH}), "fall short") == "supported"
    assert verdict(made_up(low | {"uniform": HIGH + 5, "sac": HIGH}), "fall short") == "contradicted"
    assert verdict(made_up(low | {"sac": HIGH[:5]}), "fall short") == "undecided"


def test_robustness_is_the_spread_of_the_scores():
    narrow, wide = np.linspace(9, 10, 20), np.linspace(0, 15, 20)
    robust = made_up({"effect": narrow, "uniform": wide, "random": wide, "sac": narrow})
    assert verdict(robust, "similar to SAC's") == "supported"
    assert verdict(robust, "as robust") == "supported"
    turned = made_up({"effect": wide, "uniform": narrow, "random": wide, "sac": narrow})
    assert verdict(turned, "similar to SAC's") == "contradicted"
    assert verdict(turned, "as robust") == "contradicted"


def test_speed_is_compared_in_training_steps():
    results = made_up({"effect": HIGH, "uniform": LOW, "random": LOW}, samples={"effect": 2000})
    assert verdict(results, "way slower") == "contradicted"  # all made-up curves rise alike
    assert verdict(results, "convergence speed") == "undecided"
    assert verdict(results, "similarly fast") == "supported"
    late = made_up({"effect": HIGH, "random": HIGH})
    late.evaluations.loc[(late.evaluations["method"] == "random") & (late.evaluations["step"] < 20_000), "return"] = 0.0
    assert verdict(late, "similarly fast") == "contradicted"
    assert verdict(late, "convergence speed") == "supported"


def test_close_is_within_one_step_of_the_stairs():
    near, wide = HIGH - 0.2 * rng.normal(1, 0.1, 20), rng.normal(10, 5, 20)
    assert verdict(made_up({"effect": HIGH, "uniform": near}), "close in average") == "supported"
    assert verdict(made_up({"effect": HIGH, "uniform": LOW}), "close in average") == "contradicted"
    assert verdict(made_up({"effect": HIGH, "uniform": wide}), "close in average") == "undecided"


def test_the_maximum_must_be_above_both():
    assert verdict(made_up(SETS), "maximum reward") == "supported"
    assert verdict(made_up(SETS | {"random": HIGH + 3}), "maximum reward") == "contradicted"


def test_a_quick_study_says_nothing():
    assert set(paper_claims(made_up({"effect": HIGH, "uniform": LOW}, quick=True))["verdict"]) == {
        "quick: says nothing"
    }


def test_that_something_never_happened_contradicts_some_do_only_after_enough_runs():
    assert verdict(made_up({"effect": [3.0, 15.0]}), "Some runs") == "supported"
    assert verdict(made_up({"effect": [3.0] * 20}), "Some runs") == "undecided"  # 3 in 20 might be missed
    assert verdict(made_up({"effect": [3.0] * 31}), "Some runs") == "contradicted"


def test_claims_about_methods_that_are_not_there_are_left_out():
    assert paper_claims(made_up({"fixed": LOW})).empty
    assert not any("SAC" in says for says in verdicts(made_up({"effect": HIGH, "uniform": LOW})))


def test_p_values_allow_for_the_number_of_rows_that_are_tested():
    table = paper_claims(made_up({"effect": HIGH, "uniform": LOW, "random": HIGH[::-1]}))
    tested = table["p"].notna()
    assert (table.loc[tested, "p (Holm)"] >= table.loc[tested, "p"]).all()
    assert table["p (Holm)"].min() == pytest.approx(tested.sum() * table["p"].min())
    assert table.loc[~tested, "p (Holm)"].isna().all()


def test_a_verdict_that_chance_gives_among_so_many_rows_is_undecided_among_them():
    edge = made_up(SETS | {"uniform": HIGH - 0.55})
    table = paper_claims(edge).set_index("the paper says").filter(like="higher than uniform", axis=0)
    assert table["verdict"].item() == "supported"
    assert table["p"].item() < 0.05 <= table["p (Holm)"].item()
    assert table["among all rows"].item() == "undecided"
    clear = paper_claims(made_up(SETS)).set_index("the paper says").filter(like="higher than uniform", axis=0)
    assert clear["among all rows"].item() == "supported"


def test_each_row_says_how_many_seeds_of_which_methods_it_rests_on():
    table = paper_claims(made_up(SETS | {"random": LOW[:6]}))
    assert "20 effect, 20 uniform" in set(table["seeds"])
    assert "20 effect, 6 random" in set(table["seeds"])


def test_two_worlds_stand_side_by_side_and_what_may_explain_it_only_where_they_differ():
    both = compare_claims(made_up(SETS), made_up(SETS | {"effect": LOW, "uniform": HIGH})).set_index("the paper says")
    (first,) = [row for says, row in both.iterrows() if all(word in says for word in RETURN)]
    assert (first["verdict"], first["verdict in the plane"]) == ("supported", "contradicted")
    assert first["seeds in the plane"] == "20 effect, 20 uniform"
    assert first["why they differ"]
    same = compare_claims(made_up(SETS), made_up(SETS))
    assert not same["why they differ"].any()
    assert (same["verdict"] == same["verdict in the plane"]).all()


def test_what_may_explain_a_difference_is_measured_in_both_worlds():
    tumbling, plane = load_published_study("tumbling"), load_published_study("plane")
    table = compare_claims(tumbling, plane).set_index("the paper says")
    (why,) = table.filter(like="higher than uniform", axis=0)["why they differ"]
    for method in ("effect", "uniform"):
        flat, deep = (study.trapped().set_index("method").loc[method] for study in (plane, tumbling))
        assert f"{flat['in the trap']:.0%} in the plane and {deep['in the trap']:.0%} in 3-D ({method})" in why
        assert f"{flat['free']:.0%} in the plane and {deep['free']:.0%} in 3-D ({method})" in why
        flat, deep = (-study.accounts().set_index("method").loc[method, "lost"] for study in (plane, tumbling))
        assert f"{flat:.1f} in the plane and {deep:.1f} in 3-D ({method})" in why
    (why,) = table.filter(like="fall short of SAC", axis=0)["why they differ"]
    stuck = [(study.ends().query("method == 'sac'")["end"] == "stuck").mean() for study in (plane, tumbling)]
    assert f"{stuck[0]:.0%} in the plane, {stuck[1]:.0%} in 3-D" in why


def test_what_the_other_study_lacks_stays_empty():
    table = compare_claims(made_up({"effect": HIGH, "uniform": LOW}), made_up({"fixed": LOW}))
    assert not table["verdict in the plane"].any()
