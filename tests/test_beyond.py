"""Prototypes found along the stairs: what is kept, and that it works from where the paper's robot never sampled."""

import numpy as np
import pytest
from toy_world import PuckWorld

from stairlab import EffectClasses, StairWorld, sample_motions
from stairlab.beyond import N_BINS, along_stairs_prototypes, reliable_counts
from stairlab.physics import Staircase
from stairlab.planning import trap_width
from stairlab.prototypes import class_agreement, effect_prototypes


@pytest.fixture(scope="module")
def prototypes():
    return along_stairs_prototypes(StairWorld(), 1000, seed=100)


@pytest.fixture(scope="module")
def classes():
    samples = sample_motions(StairWorld(), 1000, seed=100, start="drawn", progress=False)
    return EffectClasses.from_samples(samples, ("dz",), n_bins=N_BINS, seed=100)


def test_at_most_twenty_motions_stand_for_classes_that_climb(prototypes, classes):
    assert len(prototypes) == 20
    assert (classes.means[np.unique(prototypes.classes) - 1] > 0.25).all()


def test_each_class_is_one_height_in_whole_steps(classes):
    steps = classes.means[:, 0] / 0.3
    assert np.abs(steps - np.round(steps)).max() < 0.05
    assert len(np.unique(np.round(steps))) == classes.n_classes


def test_they_climb_from_nearer_to_a_riser_than_the_papers_prototypes_do(prototypes, samples):
    paper = effect_prototypes(EffectClasses.from_samples(samples), world=StairWorld())
    assert trap_width(Staircase.fifteen(), prototypes) < trap_width(Staircase.fifteen(), paper)


def test_the_same_seed_gives_the_same_set_and_another_seed_another():
    first, again, other = (along_stairs_prototypes(PuckWorld(), 300, 6, seed, feature="dheight") for seed in (0, 0, 1))
    assert np.array_equal(first.motions, again.motions)
    assert not np.array_equal(first.motions, other.motions)


def test_what_nothing_brings_about_or_changes_nothing_gets_no_prototype(classes):
    table = reliable_counts(classes, 20)
    still = np.abs(classes.means[:, 0]) < 0.01
    assert (table["xi"][still] == 0).all()
    assert (table["xi"][table["agreement"] < 0.3] == 0).all()
    assert table["xi"].sum() == 20
    assert np.ptp(table["xi"][table["xi"] > 0]) <= 1


def test_a_class_apart_is_agreed_on_and_a_mixed_one_is_not(classes):
    agreement = class_agreement(classes)
    share = classes.sizes / len(classes.samples)
    assert agreement.shape == (classes.n_classes,)
    assert agreement[np.argmax(share)] == 1
    assert (agreement[share < 0.003] < 0.3).all()


def test_a_world_without_stairs_has_reliable_prototypes_too():
    found = along_stairs_prototypes(PuckWorld(), 500, n=6, feature="dheight")
    assert len(found) == 6
    assert (found.motions[:, 2] > 0.7).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n": 0}, "n must be at least 1, not 0"),
        ({"least": 1.5}, "least must be between 0 and 1"),
        ({"least": 1.0}, "Sample more, or lower the share"),
    ],
)
def test_bad_arguments_are_refused(classes, arguments, message):
    with pytest.raises(ValueError, match=message):
        reliable_counts(classes, **arguments)
