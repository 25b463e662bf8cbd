"""Equations 2 to 4, the sets that the method is compared with, and reliability."""

import dataclasses
import itertools
import warnings

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_world import PuckWorld

from stairlab import (
    EffectClasses,
    Prototypes,
    StairWorld,
    TumblingWorld,
    effect_prototypes,
    prototype_counts,
    random_prototypes,
    reliability,
    replay_motions,
    sample_motions,
    uniform_prototypes,
)
from stairlab._validation import seed_sequence

PUBLISHED_MEANS = [[0.092, 0], [0.290, 0], [0.575, 0.3], [0.994, 0.6], [1.413, 0.9], [1.702, 1.2]]
PUBLISHED_STDS = [0.062, 0.023, 0.114, 0.104, 0.102, 0.096]
PUBLISHED_SIZES = [392, 1160, 183, 113, 108, 44]


@pytest.fixture(scope="module")
def world():
    return StairWorld()


@pytest.fixture(scope="module")
def classes(samples):
    return EffectClasses.from_samples(samples, seed=0)


@pytest.fixture(scope="module")
def prototypes(classes, world):
    return effect_prototypes(classes, seed=0, world=world)


def with_statistics(classes, means, stds, sizes):
    means, stds = (np.asarray(values, dtype=float) for values in (means, stds))
    return dataclasses.replace(classes, means=means, stds=stds, sizes=np.asarray(sizes))


def warnings_of(function, *arguments):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = function(*arguments)
    return result, " ".join(str(warning.message) for warning in caught)


def test_the_published_class_statistics_give_the_published_counts(classes):
    stds = np.column_stack([PUBLISHED_STDS, np.zeros(6)])
    counts = prototype_counts(with_statistics(classes, PUBLISHED_MEANS, stds, PUBLISHED_SIZES))
    assert counts["xi"].tolist() in ([1, 1, 4, 4, 4, 4], [1, 1, 5, 4, 4, 4])


def test_counts_follow_equations_2_and_3_to_the_letter(classes):
    counts = prototype_counts(classes)
    mu, sigma = classes.means.sum(axis=1), classes.stds.sum(axis=1)
    weight = (1 - sigma / mu) * sigma
    assert counts["xi"].tolist() == np.minimum(np.floor(weight / weight.min()), 10).tolist()
    np.testing.assert_allclose(counts["cv"], sigma / mu)


def test_means_and_deviations_are_divided_by_the_largest_of_them_all(classes):
    counts = prototype_counts(classes)
    assert max(counts["mean"].max(), counts["std"].max()) == pytest.approx(1)
    assert counts["mean"].iloc[0] / counts["std"].iloc[0] == pytest.approx(
        classes.means[0].sum() / classes.stds[0].sum()
    )


@settings(deadline=None, derandomize=True, max_examples=100)
@given(
    st.lists(st.tuples(st.floats(-2, 2), st.floats(0, 1), st.integers(1, 50)), min_size=6, max_size=6),
    st.integers(1, 12),
)
def test_counts_lie_between_one_and_the_cap_whatever_the_classes(classes, statistics, cap):
    means, stds, sizes = map(np.array, zip(*statistics, strict=True))
    stds = np.where(sizes == 1, 0, stds)
    odd = with_statistics(classes, means[:, None], stds[:, None], sizes)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        xi = prototype_counts(odd, cap=cap)["xi"]
    assert xi.between(1, cap).all()
    assert (xi[sizes == 1] == 1).all()


def test_counts_do_not_depend_on_the_unit_of_the_effects(classes):
    in_millimetres = with_statistics(classes, 1000 * classes.means, 1000 * classes.stds, classes.sizes)
    assert prototype_counts(in_millimetres)["xi"].tolist() == prototype_counts(classes)["xi"].tolist()


def test_a_class_of_one_sample_gets_one_prototype_and_does_not_set_the_scale(classes):
    sizes, stds = classes.sizes.copy(), classes.stds.copy()
    sizes[5], stds[5] = 1, 0
    counts = prototype_counts(with_statistics(classes, classes.means, stds, sizes))
    assert counts["xi"].iloc[5] == 1
    assert counts["xi"].iloc[:5].tolist() == prototype_counts(classes)["xi"].iloc[:5].tolist()


def test_a_spread_above_the_mean_is_clipped_and_its_class_is_named(classes):
    stds = classes.stds.copy()
    stds[2] = 5
    counts, said = warnings_of(prototype_counts, with_statistics(classes, classes.means, stds, classes.sizes))
    assert counts["cv"].iloc[2] == 0.999999
    assert "leaves [0, 1] for {'C_3': 11." in said
    assert "C_3 has a weight" in said


def test_a_negative_mean_effect_is_named(classes):
    means = classes.means.copy()
    means[0] = [-0.5, 0]
    with pytest.warns(UserWarning, match=r"leaves \[0, 1\] for \{'C_1': -0.11\}"):
        prototype_counts(with_statistics(classes, means, classes.stds, classes.sizes))


def test_on_height_alone_the_spreads_are_jitter_so_counts_hit_the_cap_and_a_warning_says_why(samples):
    heights = EffectClasses.from_samples(samples, "dz")
    counts, said = warnings_of(prototype_counts, heights)
    assert "C_1" in said
    assert counts["xi"].tolist()[1:] == [10] * (heights.n_classes - 1)


def test_a_class_with_one_prototype_gets_its_mean_motion(classes, prototypes):
    counts = prototype_counts(classes)
    single = counts.index[counts["xi"] == 1]
    assert len(single) >= 2
    for number in single:
        np.testing.assert_allclose(prototypes.of_class(number)[0], classes.motions_of(number).mean(axis=0))


def test_the_released_code_takes_the_sample_with_the_nearest_effect_instead(classes, world):
    prototypes = effect_prototypes(classes, single="nearest-effect", world=world)
    effects = classes.samples.effect("dy", "dz")[classes.labels == 2]
    nearest = np.linalg.norm(effects - classes.means[1], axis=1).argmin()
    np.testing.assert_allclose(prototypes.of_class(2), classes.motions_of(2)[[nearest]])


def test_no_class_gets_more_than_xi_prototypes_and_each_gets_one(classes, prototypes):
    xi = prototype_counts(classes)["xi"]
    made = pd.Series(prototypes.classes).value_counts().reindex(xi.index)
    assert (made >= 1).all()
    assert (made <= xi).all()


def test_prototypes_lie_among_the_motions_of_their_class(classes, prototypes):
    for number in classes.numbers:
        members = classes.motions_of(number)
        own = prototypes.of_class(number)
        assert (members.min(axis=0) <= own).all()
        assert (own <= members.max(axis=0)).all()


def test_a_fixed_count_is_the_papers_method_b(classes, world):
    fixed = effect_prototypes(classes, fixed=5, world=world)
    assert fixed.method == "fixed"
    assert pd.Series(fixed.classes).value_counts().max() <= 5
    assert fixed.settings["xi"] == [5] * 6


def test_counts_of_ones_own_are_taken_as_they_are(classes):
    ones = pd.DataFrame({"xi": [1] * 6}, index=pd.Index(classes.numbers, name="class"))
    assert len(effect_prototypes(classes, counts=ones)) == 6


def test_a_class_with_a_count_of_zero_gets_no_prototype(classes):
    counts = pd.DataFrame({"xi": [0, 2, 0, 3, 1, 0]}, index=classes.numbers)
    assert set(effect_prototypes(classes, counts=counts).classes) == {2, 4, 5}
    with pytest.raises(ValueError, match="not all 0"):
        effect_prototypes(classes, counts=0 * counts)


def test_kmeans_places_as_many_prototypes_as_were_asked_for(classes):
    found = effect_prototypes(classes, fixed=7, place="k-means")
    assert np.bincount(found.classes)[1:].tolist() == [7] * 6
    with pytest.raises(ValueError, match="place must be one of 'rgng', 'k-means', not 'grid'"):
        effect_prototypes(classes, place="grid")


def test_the_same_seed_gives_the_same_prototypes_and_another_seed_others(classes, prototypes, world):
    again = effect_prototypes(classes, seed=0, world=world)
    assert (again.motions == prototypes.motions).all()
    other = effect_prototypes(classes, seed=1, world=world)
    assert other.motions.shape != prototypes.motions.shape or (other.motions != prototypes.motions).any()


@pytest.mark.parametrize("refine", ["nearest", "central", "agreeing"])
def test_refined_prototypes_are_observed_motions_of_their_class(classes, refine):
    refined = effect_prototypes(classes, refine=refine)
    for motion, number in zip(refined.motions, refined.classes, strict=True):
        assert np.abs(classes.motions_of(number) - motion).max(axis=1).min() < 1e-9


def test_refined_prototypes_do_what_they_are_for(classes, world):
    for refine in ("nearest", "central", "agreeing"):
        assert reliability(world, effect_prototypes(classes, refine=refine, world=world), classes).exact == 1


@pytest.mark.slow
def test_the_core_of_each_class_gives_ninety_percent_under_noise_over_ten_seeds(world):
    noisy = {"none": [], "core": []}
    for seed in range(10):
        samples = sample_motions(world, n=2000, seed=seed, progress=False)
        classes = EffectClasses.from_samples(samples, seed=seed)
        for refine, shares in noisy.items():
            made = effect_prototypes(classes, seed=seed, refine=refine, world=world)
            shares.append(reliability(world, made, classes, seed=seed).noisy)
    assert np.mean(noisy["core"]) > 0.9
    assert np.mean(noisy["core"]) > np.mean(noisy["none"])


def test_uniform_prototypes_are_a_grid_with_the_corners(world):
    uniform = uniform_prototypes(world)
    assert len(uniform) == 16
    assert uniform.classes is None
    corners = {(50.0, 1.0), (50.0, 89.0), (1000.0, 1.0), (1000.0, 89.0)}
    assert corners <= set(map(tuple, uniform.motions))
    assert np.allclose(np.unique(uniform.motions[:, 0]), [50, 50 + 950 / 3, 50 + 1900 / 3, 1000])


def test_a_uniform_set_can_have_any_size_and_keeps_the_corners(world):
    for n in range(4, 30):
        motions = uniform_prototypes(world, n=n).motions
        assert len(np.unique(motions, axis=0)) == n
        assert {(50, 1), (1000, 1), (50, 89), (1000, 89)} <= set(map(tuple, motions.tolist()))
    same = uniform_prototypes(world, n=16).motions
    assert sorted(map(tuple, same.tolist())) == sorted(map(tuple, uniform_prototypes(world).motions.tolist()))
    with pytest.raises(ValueError, match="n must be at least 4, not 3"):
        uniform_prototypes(world, n=3)
    with pytest.raises(ValueError, match="n needs a world with two motion parameters, not 3"):
        uniform_prototypes(PuckWorld(), n=9)


@pytest.mark.parametrize("per_side", [2, 4, 5])
def test_a_shifted_grid_has_one_motion_in_each_cell_at_the_same_place_and_no_corner(world, per_side):
    low, high = world.motion_low, world.motion_high
    sets = [uniform_prototypes(world, per_side, seed=seed).motions for seed in range(20)]
    for motions in sets:
        assert len(motions) == per_side**2
        cells, place = np.divmod((motions - low) / (high - low) * per_side, 1)
        assert {tuple(cell) for cell in cells.astype(int)} == set(itertools.product(range(per_side), repeat=2))
        np.testing.assert_allclose(place, place[[0]].repeat(len(place), axis=0), rtol=0, atol=1e-9)
        assert ((low < motions) & (motions < high)).all()
    firsts = np.array([motions[0] for motions in sets])
    assert len(np.unique(firsts, axis=0)) == 20
    width = (high - low) / per_side
    assert (np.ptp(firsts, axis=0) > 0.6 * width).all()  # the whole cell is drawn from


def test_a_shifted_grid_follows_its_seed_and_says_so(world):
    one, same, other = (uniform_prototypes(world, seed=seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(one.motions, same.motions)
    assert (one.motions != other.motions).all()
    assert (one.method, one.seed, one.settings) == ("uniform", "7", {"per_side": 4, "shifted": True})
    assert uniform_prototypes(world).settings == {"per_side": 4}
    assert uniform_prototypes(world).seed == ""
    assert len(uniform_prototypes(PuckWorld(), 3, seed=0)) == 27
    assert not (random_prototypes(world, 16, seed=7).motions == one.motions).any()


def test_rows_of_any_number_cannot_be_shifted(world):
    with pytest.raises(ValueError, match="n and seed must not be given both: only a square grid can be shifted"):
        uniform_prototypes(world, n=16, seed=0)
    with pytest.raises(ValueError, match="seed must be at least 0"):
        uniform_prototypes(world, seed=-1)


def test_random_prototypes_are_drawn_from_the_motion_space(world):
    motions = random_prototypes(world, n=500, seed=1).motions
    assert (motions >= world.motion_low).all()
    assert (motions <= world.motion_high).all()
    np.testing.assert_allclose(motions.mean(axis=0), [525, 45], rtol=0.1)
    assert len(random_prototypes(world)) == 10
    assert (random_prototypes(world, seed=1).motions == motions[:10]).all()


def test_reliability_replays_each_prototype_by_the_rule(classes, prototypes, world):
    result = reliability(world, prototypes, classes)
    replayed = replay_motions(world, prototypes.motions)
    effects = replayed.effect("dy", "dz")
    reached = 1 + np.linalg.norm(effects[:, None] - classes.means, axis=2).argmin(axis=1)
    own = (reached == prototypes.classes) & replayed.on_map
    assert result.exact == own.mean()
    assert result.on_map == replayed.on_map.mean()
    assert result.table["noisy in class"].mean() == pytest.approx(result.noisy)
    assert len(result.table) == len(prototypes)


def test_the_middle_of_a_wide_class_is_reliable_and_its_edge_is_not(classes, world):
    middle = Prototypes([[600.0, 10.0]], [2])
    assert (reliability(world, middle, classes).exact, reliability(world, middle, classes).noisy) == (1, 1)
    wrong = Prototypes([[600.0, 10.0]], [5])
    assert (reliability(world, wrong, classes).exact, reliability(world, wrong, classes).noisy) == (0, 0)


def test_sets_without_classes_have_a_share_on_the_map_and_the_classes_they_reach(classes, world):
    result = reliability(world, uniform_prototypes(world), classes)
    assert np.isnan(result.exact)
    assert np.isnan(result.noisy)
    assert 0 < result.on_map < 1
    assert 1 <= result.classes_reached <= 6
    assert result.classes_reached == len(set(result.table["reached"]) - {0})


def test_the_same_seed_gives_the_same_noise(classes, prototypes, world):
    first, again, other = (reliability(world, prototypes, classes, seed=seed).table for seed in (4, 4, 5))
    assert first.equals(again)
    assert not first.equals(other)


def test_a_file_keeps_everything(prototypes, tmp_path):
    prototypes.to_csv(tmp_path / "prototypes.csv")
    again = Prototypes.from_csv(tmp_path / "prototypes.csv")
    assert (again.motions == prototypes.motions).all()
    assert (again.classes == prototypes.classes).all()
    assert (again.method, again.seed, again.settings) == (prototypes.method, prototypes.seed, prototypes.settings)


def test_counts_are_taken_by_class_whatever_their_order(classes):
    counts = prototype_counts(classes)
    turned = effect_prototypes(classes, counts=counts.iloc[::-1])
    assert turned.settings["xi"] == counts["xi"].tolist()
    with pytest.raises(ValueError, match="counts and fixed must not be given both"):
        effect_prototypes(classes, counts=counts, fixed=5)


def test_one_seed_gives_every_function_a_stream_of_its_own(world):
    drawn = sample_motions(world, n=10, seed=0, progress=False).motions
    assert not (random_prototypes(world, n=10, seed=0).motions == drawn).any()


def test_reliability_hands_its_seed_to_a_world_that_drifts():
    drifting = StairWorld(x_drift=True)
    aside = EffectClasses.from_samples(sample_motions(drifting, n=400, progress=False), "dx")
    climbs = Prototypes([[330.0 + 10 * i, 70.0] for i in range(8)], [1] * 8)
    reached = [reliability(drifting, climbs, aside, seed, replays=1).table["reached"].tolist() for seed in (0, 0, 1)]
    assert reached[0] == reached[1]
    assert reached[0] != reached[2]


@pytest.mark.parametrize("wrong", [None, 10, StairWorld, "stairs"])
def test_something_that_is_no_world_is_refused(wrong, classes, prototypes):
    for function, arguments in (
        (sample_motions, (wrong,)),
        (replay_motions, (wrong, [[500, 45]])),
        (uniform_prototypes, (wrong,)),
        (random_prototypes, (wrong,)),
        (reliability, (wrong, prototypes, classes)),
    ):
        with pytest.raises(TypeError, match="world must be a world, such as"):
            function(*arguments)


def test_a_set_cannot_be_changed_once_it_is_checked(prototypes, samples):
    for array in (prototypes.motions, prototypes.classes, samples.motions, samples.effects):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_a_bare_table_of_motions_is_a_set_too(tmp_path):
    (tmp_path / "mine.csv").write_text("angle,magnitude\n70,600\n45,300\n")
    mine = Prototypes.from_csv(tmp_path / "mine.csv")
    assert mine.motions.tolist() == [[600, 70], [300, 45]]
    assert (mine.method, mine.classes) == ("mine", None)


@pytest.mark.filterwarnings("ignore:The coefficient of variation", "ignore:C_1 has a weight")
def test_a_world_without_stairs_goes_through_classes_and_prototypes():
    world = PuckWorld()
    samples = sample_motions(world, n=400, seed=0, progress=False)
    classes = EffectClasses.from_samples(samples, ("deast", "dheight"), seed=0)
    prototypes = effect_prototypes(classes, seed=0, world=world)
    assert prototypes.motion_names == ("speed", "heading", "lift")
    result = reliability(world, prototypes, classes)
    assert result.classes_reached >= 2
    assert 0 <= result.noisy <= 1
    assert len(uniform_prototypes(world, per_side=3)) == 27
    assert set(prototypes.classes) == set(classes.numbers)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"fixed": 0}, ValueError, "fixed must be at least 1, not 0"),
        ({"fixed": 2.5}, TypeError, "fixed must be a whole number, not 2.5"),
        ({"single": "median"}, ValueError, "single must be one of"),
        ({"refine": "best"}, ValueError, "refine must be one of"),
        ({"counts": [1, 2]}, TypeError, "counts must be a table with a column 'xi'"),
        ({"counts": pd.DataFrame({"xi": [1, 2]})}, ValueError, r"counts\[.xi.\] must be finite"),
        ({"seed": -1}, ValueError, "seed must be at least 0"),
    ],
)
def test_bad_arguments_are_refused_by_name(classes, arguments, error, message):
    with pytest.raises(error, match=message):
        effect_prototypes(classes, **arguments)


def test_things_that_are_not_classes_are_refused(world, classes, prototypes):
    with pytest.raises(TypeError, match="classes must be EffectClasses, not list"):
        prototype_counts([1, 2])
    with pytest.raises(TypeError, match="classes must be EffectClasses, not list"):
        effect_prototypes([1, 2])
    few = EffectClasses.from_samples(classes.samples, k_range=(3, 3))
    with pytest.raises(ValueError, match="one is of class 6"):
        reliability(world, prototypes, few)
    with pytest.raises(ValueError, match="per_side must be at least 2"):
        uniform_prototypes(world, 1)
    with pytest.raises(ValueError, match="n must be at least 1"):
        random_prototypes(world, 0)


@pytest.mark.parametrize(
    ("motions", "classes", "message"),
    [
        ([], None, "motions must have the shape"),
        ([[1, 2, 3]], None, r"motions must have the shape \(n, 2\), not \(1, 3\)"),
        ([[np.nan, 2]], None, "motions must be finite"),
        ([[100, 20]], [1, 2], "a number from 1 for each of 1 motions"),
        ([[100, 20]], [0], "a number from 1"),
    ],
)
def test_bad_sets_are_refused(motions, classes, message):
    with pytest.raises(ValueError, match=message):
        Prototypes(motions, classes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("magnitude,angle\n", "has no row"),
        ("magnitude,angle,class\n500,30,1.7\n", "line 2, column class: expected a whole number, found 1.7"),
        ("magnitude\n5\n", "line 1: the column angle must be there"),
        ("magnitude,angle\n500,high\n", "line 2, column angle: expected a finite number, found 'high'"),
        ("magnitude,angle\n500,30\n400\n", "line 3: expected 2 cells, found 1"),
        ("# settings: {broken\nmagnitude,angle\n500,30\n", "line 1: expected a JSON object after 'settings: '"),
    ],
)
def test_bad_files_are_refused_with_line_and_column(tmp_path, text, message):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(ValueError, match=message):
        Prototypes.from_csv(tmp_path / "bad.csv")


# In a random world

LUCKY, SURE, LOST = (500.0, 70.0), (450.0, 65.0), (1000.0, 60.0)
""" In three dimensions: two or three steps, as the rocking has it; always two; off the map """


def test_in_a_random_world_exact_replays_are_draws_and_shares_their_means(classes):
    world, made = TumblingWorld(), Prototypes([LUCKY, SURE, LOST], [4, 4, 6])
    result = reliability(world, made, classes, seed=3)
    table = result.table
    for_exact, *_ = seed_sequence(3, "reliability").spawn(3)
    reached = classes.reached(replay_motions(world, made.motions.repeat(20, axis=0), for_exact)).reshape(3, 20)
    assert table["in class"].tolist() == (reached == [[4], [4], [6]]).mean(axis=1).tolist()
    assert 0 < table["in class"][0] < 1
    assert table["in class"].tolist()[1:] == [1, 0]
    assert table["on map"].tolist() == [1, 1, 0]
    assert (result.exact, result.on_map) == pytest.approx((table["in class"].mean(), 2 / 3))


def test_in_a_random_world_the_class_reached_is_the_one_reached_most_often(classes):
    table = reliability(TumblingWorld(), Prototypes([LUCKY, SURE, LOST], [5, 4, 6]), classes, seed=1).table
    assert table["in class"][0] != 0.5
    assert table["reached"].tolist() == [5 if table["in class"][0] > 0.5 else 4, 4, 0]


def test_in_a_random_world_the_number_of_replays_is_that_of_exact_ones_too(classes):
    table = reliability(TumblingWorld(), Prototypes([LUCKY], [4]), classes, replays=3).table
    for column in ("in class", "noisy in class"):
        assert 3 * table[column][0] == pytest.approx(round(3 * table[column][0]))


def test_in_a_random_world_draws_follow_the_seed(classes):
    made = Prototypes([LUCKY] * 4, [4] * 4)
    first, again, other = (reliability(TumblingWorld(), made, classes, seed=seed).table for seed in (0, 0, 1))
    assert first.equals(again)
    assert first["in class"].nunique() > 1  # each replay has a draw of its own
    assert first["in class"].tolist() != other["in class"].tolist()


def test_a_random_world_has_no_share_in_class_for_a_set_without_classes(classes):
    result = reliability(TumblingWorld(), Prototypes([SURE, LOST]), classes)
    assert np.isnan(result.exact)
    assert result.table["in class"].isna().all()
    assert result.table["on map"].tolist() == [1, 0]


@pytest.mark.parametrize("world", [StairWorld(), TumblingWorld(rocking=0)])
def test_a_world_that_is_not_random_replays_each_motion_once(world, classes, monkeypatch):
    asked = []

    def counting(world, motions, seed):
        asked.append(len(motions))
        return replay_motions(world, motions, seed)

    monkeypatch.setattr("stairlab.prototypes.replay_motions", counting)
    result = reliability(world, Prototypes([LUCKY, SURE, LOST], [4, 4, 6]), classes)
    assert asked == [3, 60]
    assert "in class" not in result.table
    assert result.exact == pytest.approx(result.table.eval("reached == `class`").mean())


@pytest.mark.filterwarnings("ignore:The coefficient of variation", "ignore:C_1 has a weight")
def test_a_world_that_does_not_say_that_it_is_random_is_not():
    world = PuckWorld()
    classes = EffectClasses.from_samples(sample_motions(world, n=200, seed=0, progress=False), ("deast", "dheight"))
    assert "on map" not in reliability(world, random_prototypes(world, n=4), classes).table
    world.random = True
    assert "on map" in reliability(world, random_prototypes(world, n=4), classes).table
