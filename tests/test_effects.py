"""Algorithm 2: effect classes."""

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.cluster import KMeans as ReferenceKMeans
from sklearn.metrics import davies_bouldin_score, silhouette_score

from stairlab import EffectClasses, Samples, StairWorld, sample_motions
from stairlab.effects import PRESETS


def samples_with_effects(effects, names=("a", "b")):
    effects = np.asarray(effects, dtype=float)
    ones = np.ones((len(effects), len(names)))
    return Samples(ones[:, :1], ones, effects, np.ones(len(effects), bool), tuple(names), ("push",))


@pytest.fixture(scope="module")
def samples():
    return sample_motions(StairWorld(), n=2000, seed=3, progress=False)


@pytest.fixture(scope="module")
def classes(samples):
    return EffectClasses.from_samples(samples, seed=3)


def test_the_stairs_give_six_classes_two_on_the_ground_and_one_for_each_step(classes):
    steps = np.round(classes.means[:, 1] / 0.3).astype(int)
    assert steps.tolist() == [0, 0, 1, 2, 3, 4]
    assert np.abs(classes.means[:, 1] - 0.3 * steps).max() < 0.01


@pytest.mark.slow
def test_six_classes_come_out_for_at_least_nine_of_ten_seeds():
    found = []
    for seed in range(10):
        samples = sample_motions(StairWorld(), n=2000, seed=seed, progress=False)
        means = EffectClasses.from_samples(samples, seed=seed).means
        found.append(np.round(means[:, 1] / 0.3).tolist() == [0, 0, 1, 2, 3, 4])
    assert sum(found) >= 9


def test_samples_off_the_map_have_the_label_zero_and_all_others_a_class(classes, samples):
    assert ((classes.labels == 0) == ~samples.on_map).all()
    assert set(classes.labels) == set(range(classes.n_classes + 1))
    assert classes.sizes.sum() == samples.on_map.sum()


def test_means_and_deviations_are_those_of_the_members(classes, samples):
    for number in classes.numbers:
        members = samples.effect("dy", "dz")[classes.labels == number]
        np.testing.assert_allclose(classes.means[number - 1], members.mean(axis=0), atol=1e-12)
        np.testing.assert_allclose(classes.stds[number - 1], members.std(axis=0, ddof=1), atol=1e-12)
        assert classes.sizes[number - 1] == len(members) == len(classes.motions_of(number))


def test_classes_are_ordered_by_the_length_of_their_mean_effect(classes):
    lengths = np.linalg.norm(classes.means, axis=1)
    assert (np.diff(lengths) > 0).all()


def test_equal_lengths_are_ordered_by_the_first_dimension():
    around = np.array([[0.0, 0.01], [0.0, -0.01]])
    effects = np.vstack([np.add(centre, around) for centre in ([1.0, 0.0], [-1.0, 0.0], [0.0, 3.0])])
    classes = EffectClasses.from_samples(samples_with_effects(effects), ("da", "db"), k_range=(3, 3))
    np.testing.assert_allclose(classes.means, [[-1, 0], [1, 0], [0, 3]], atol=1e-12)


def test_labels_are_stable_under_the_order_of_the_samples(samples):
    few = samples[:400]
    order = np.random.default_rng(0).permutation(len(few))
    straight, shuffled = (EffectClasses.from_samples(each, seed=0) for each in (few, few[order]))
    assert (straight.labels[order] == shuffled.labels).all()


def test_the_chosen_k_is_the_first_with_the_best_silhouette_by_scikit_learn(classes, samples):
    effects = samples.on_the_map().effect("dy", "dz")
    labels = classes.labels[samples.on_map]
    best = classes.scores.loc[classes.scores["score"].idxmax()]
    assert best["k"] == classes.n_classes
    assert best["score"] == pytest.approx(silhouette_score(effects, labels), abs=1e-9)
    reference = ReferenceKMeans(6, n_init=10, random_state=0).fit(effects)
    inertia = sum(((effects[labels == n] - classes.means[n - 1]) ** 2).sum() for n in classes.numbers)
    assert inertia <= 1.001 * reference.inertia_


def test_the_presets_are_the_three_readings_of_the_paper(samples):
    assert EffectClasses.from_samples(samples, preset="paper-text").n_classes == 2
    released = EffectClasses.from_samples(samples, preset="released-code")
    assert released.settings["criterion"] == "davies-bouldin"
    assert released.settings["scaling"] == "max-abs"
    assert released.scores["k"].tolist() == list(range(3, 11))
    assert set(PRESETS) == {"paper-figures", "paper-text", "released-code"}


def test_davies_bouldin_takes_the_lowest_index_on_scaled_effects(samples):
    classes = EffectClasses.from_samples(samples[:600], preset="released-code")
    effects = samples[:600].on_the_map().effect("dy", "dz")
    scaled = effects / np.abs(effects).max(axis=0)
    lowest = classes.scores["score"].min()
    assert lowest == pytest.approx(davies_bouldin_score(scaled, classes.labels[classes.labels > 0]), abs=1e-9)


def test_options_replace_what_the_preset_says(samples):
    classes = EffectClasses.from_samples(samples[:500], preset="paper-text", k_range=(4, 4), scaling="max-abs")
    assert (classes.n_classes, classes.settings["scaling"], classes.settings["criterion"]) == (
        4,
        "max-abs",
        "silhouette",
    )


def test_one_effect_dimension_gives_histogram_classes_without_empty_bins(samples):
    classes = EffectClasses.from_samples(samples, ["dz"])
    assert classes.settings["method"] == "histogram"
    dz = samples.on_the_map().effect("dz")[:, 0]
    counts = np.histogram(dz, bins=10)[0]
    assert sorted(classes.sizes) == sorted(counts[counts > 0])
    assert classes.n_classes >= 5
    assert classes.scores.empty


def test_predict_gives_the_samples_their_own_labels(classes, samples):
    on_map = samples.on_the_map()
    assert (classes.predict(on_map.effect("dy", "dz")) == classes.labels[samples.on_map]).all()
    one = EffectClasses.from_samples(samples, "dz")
    assert (one.predict(on_map.effect("dz")) == one.labels[samples.on_map]).all()
    scaled = EffectClasses.from_samples(samples, preset="released-code")
    assert (scaled.predict(on_map.effect("dy", "dz")) == scaled.labels[samples.on_map]).all()


def test_a_mean_effect_is_nearest_to_its_own_class(classes):
    assert classes.nearest_mean(classes.means).tolist() == list(classes.numbers)


def test_a_jump_reaches_the_class_of_the_nearest_mean_effect_and_none_off_the_map(classes):
    jumps = sample_motions(StairWorld(), n=150, seed=77, progress=False)
    distances = scipy.spatial.distance.cdist(jumps.effect("dy", "dz"), classes.means)
    assert np.array_equal(classes.reached(jumps)[jumps.on_map], 1 + distances.argmin(axis=1)[jumps.on_map])
    assert not jumps.on_map.all()
    assert (classes.reached(jumps)[~jumps.on_map] == 0).all()


def test_the_same_seed_gives_the_same_classes(samples, classes):
    again = EffectClasses.from_samples(samples, seed=3)
    assert (again.labels == classes.labels).all()
    assert again.scores.equals(classes.scores)


def test_the_table_has_a_row_for_each_class(classes):
    table = classes.to_frame()
    assert table.index.tolist() == [1, 2, 3, 4, 5, 6]
    assert list(table) == ["size", "mean dy", "mean dz", "std dy", "std dz"]


@settings(deadline=None, derandomize=True, max_examples=30)
@given(st.integers(2, 4), st.integers(0, 1000))
def test_well_separated_groups_are_found_whatever_their_number(groups, seed):
    rng = np.random.default_rng(seed)
    centres = np.array([[10.0 * i, 4.0 * i * i] for i in range(1, groups + 1)])
    effects = np.repeat(centres, 12, axis=0) + rng.normal(0, 0.1, (12 * groups, 2))
    classes = EffectClasses.from_samples(samples_with_effects(effects), ("da", "db"), k_range=(2, 6))
    assert classes.sizes.tolist() == [12] * groups


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"features": ("dy", "height")}, "features must be one of .* not 'height'"),
        ({"features": ()}, "features must be one or more"),
        ({"features": ("dy", "dy")}, "features must be one or more different"),
        ({"preset": "paper"}, "preset must be one of"),
        ({"criterion": "elbow"}, "criterion must be one of"),
        ({"scaling": "log"}, "scaling must be one of"),
        ({"k_range": (1, 4)}, r"k_range\[0\] must be at least 2, not 1"),
        ({"k_range": (5, 3)}, r"k_range\[1\] must be at least 5, not 3"),
        ({"k_range": 6}, "k_range must be the smallest and the largest k"),
        ({"seed": -1}, "seed must be at least 0"),
    ],
)
def test_bad_arguments_are_refused_by_name(samples, arguments, message):
    with pytest.raises(ValueError, match=message):
        EffectClasses.from_samples(samples[:50], **arguments)


def test_something_that_is_not_samples_is_refused():
    with pytest.raises(TypeError, match=r"samples must be Samples.* not ndarray"):
        EffectClasses.from_samples(np.zeros((5, 2)))


def test_effects_that_cannot_be_grouped_are_refused(samples):
    with pytest.raises(ValueError, match="samples on the map must have at least 2 rows, not 1"):
        EffectClasses.from_samples(samples[samples.on_map][:1])
    with pytest.raises(ValueError, match="k_range must end at 1 or below, as there are 1 distinct effects, not at 6"):
        EffectClasses.from_samples(samples_with_effects(np.ones((20, 2))), ("da", "db"))
    with pytest.raises(ValueError, match="none of the"):
        EffectClasses.from_samples(samples[~samples.on_map])


def test_bad_effects_to_predict_are_refused(classes):
    with pytest.raises(ValueError, match=r"effects must have the shape \(n, 2\), not \(3,\)"):
        classes.predict([1, 2, 3])
    with pytest.raises(ValueError, match="effects must be finite"):
        classes.predict([[np.nan, 1]])
