"""What the checks of lesson 03 say of solutions, of usual mistakes, and of what else is special to them."""

import math
import warnings

import numpy as np
import pytest

from stairlab.checks import check_histogram_bin, check_inertia, check_nearest_centers, check_update_centers

from .verdicts import answered, assert_right


def histogram_bin(value, low, high, n_bins):
    return min(int((value - low) / (high - low) * n_bins), n_bins - 1)


def squared(samples, centers):
    return ((samples[:, None, :] - centers) ** 2).sum(axis=2)


def nearest_centers(samples, centers):
    return squared(samples, centers).argmin(axis=1)


def refilled_labels(samples, labels, centers):
    labels = labels.copy()
    for empty in np.flatnonzero(np.bincount(labels, minlength=len(centers)) == 0):
        labels[((samples - centers[labels]) ** 2).sum(axis=1).argmax()] = empty
    return labels


def update_centers(samples, labels, centers):
    labels = refilled_labels(samples, labels, centers)
    return np.array([samples[labels == k].mean(axis=0) for k in range(len(centers))])


def inertia(samples, centers):
    return squared(samples, centers).min(axis=1).sum()


SOLUTIONS = {
    check_histogram_bin: histogram_bin,
    check_nearest_centers: nearest_centers,
    check_update_centers: update_centers,
    check_inertia: inertia,
}


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_the_solution_is_right(check, solution):
    assert_right(check, solution)


def test_plain_loops_and_lists_are_right_too():
    def loops(samples, centers):
        return [min(range(len(centers)), key=lambda k: math.dist(sample, centers[k])) for sample in samples]

    def slow_update(samples, labels, centers):
        return update_centers(samples, labels, centers).tolist()

    assert check_nearest_centers(loops, more=20)
    assert check_update_centers(slow_update, more=20)


def means(samples, labels, centers, of_empty):
    return np.array(
        [samples[labels == k].mean(axis=0) if (labels == k).any() else of_empty(k) for k in range(len(centers))]
    )


def nan_means(samples, labels, centers):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.array([samples[labels == k].mean(axis=0) for k in range(len(centers))])


def counted_twice(samples, labels, centers):
    worst = ((samples - centers[labels]) ** 2).sum(axis=1).argmax()
    return means(samples, labels, centers, lambda k: samples[worst])


def far_from_empty(samples, labels, centers):
    labels = labels.copy()
    for empty in np.flatnonzero(np.bincount(labels, minlength=len(centers)) == 0):
        labels[((samples - centers[empty]) ** 2).sum(axis=1).argmax()] = empty
    return np.array([samples[labels == k].mean(axis=0) for k in range(len(centers))])


def refilled_by(distances):
    def mistaken(samples, labels, centers):
        labels = labels.copy()
        for empty in np.flatnonzero(np.bincount(labels, minlength=len(centers)) == 0):
            labels[distances(samples, labels, centers, empty).argmax()] = empty
        return np.array([samples[labels == k].mean(axis=0) for k in range(len(centers))])

    return mistaken


def nearness_to_empty(samples, labels, centers, empty):
    return -((samples - centers[empty]) ** 2).sum(axis=1)


def distance_after_update(samples, labels, centers, empty):
    return ((samples - means(samples, labels, centers, lambda k: centers[k])[labels]) ** 2).sum(axis=1)


def medians(samples, labels, centers):
    labels = refilled_labels(samples, labels, centers)
    return np.array([np.median(samples[labels == k], axis=0) for k in range(len(centers))])


def over_all(samples, labels, centers):
    labels = refilled_labels(samples, labels, centers)
    return np.array([samples[labels == k].sum(axis=0) / len(samples) for k in range(len(centers))])


MISTAKES = [
    (check_histogram_bin, lambda x, a, b, n: math.floor((x - a) / (b - a) * n), "bin n_bins, which does not exist"),
    (check_histogram_bin, lambda *case: histogram_bin(*case) + 1, "count the bins from 1; the first"),
    (check_histogram_bin, lambda x, a, b, n: int((x - a) / (b - a) * n) + 1, "a bin of its own"),
    (check_histogram_bin, lambda x, a, b, n: min(round((x - a) / (b - a) * n), n - 1), "round down"),
    (check_histogram_bin, lambda x, a, b, n: min(int(x / (b - a) * n), n - 1), "begin at low"),
    (check_histogram_bin, lambda x, a, b, n: min(int((x - a) / (b - a) * (n - 1)), n - 1), "too wide"),
    (check_histogram_bin, lambda x, a, b, n: max(math.ceil((x - a) / (b - a) * n) - 1, 0), "upper of its two bins"),
    (check_nearest_centers, lambda s, c: np.abs(s[:, None] - c).sum(axis=2).argmin(axis=1), "sum of their squares"),
    (check_nearest_centers, lambda s, c: (s[:, None] - c).sum(axis=2).argmin(axis=1), "without squaring"),
    (check_nearest_centers, lambda s, c: np.abs(s[:, :1] - c[:, 0]).argmin(axis=1), "first dimension only"),
    (check_nearest_centers, lambda s, c: squared(s, c).argmax(axis=1), "farthest"),
    (check_nearest_centers, lambda s, c: squared(s, c).argmin(axis=1) + 1, "from 1"),
    (check_nearest_centers, lambda s, c: squared(s, c).argmin(axis=0), "along the other axis"),
    (check_nearest_centers, lambda s, c: len(c) - 1 - squared(s, c)[:, ::-1].argmin(axis=1), "the first one counts"),
    (check_update_centers, nan_means, "nan"),
    (check_update_centers, lambda s, of, c: means(s, of, c, lambda k: c[k]), "stays where it was"),
    (check_update_centers, lambda s, of, c: means(s, of, c, lambda k: np.zeros(2)), "(0, 0)"),
    (check_update_centers, lambda s, of, c: np.array([s[of == k].mean(axis=0) for k in np.unique(of)]), "no row"),
    (check_update_centers, counted_twice, "counted twice"),
    (check_update_centers, far_from_empty, "farthest from the empty centre"),
    (check_update_centers, refilled_by(nearness_to_empty), "nearest to the empty centre"),
    (check_update_centers, refilled_by(distance_after_update), "after the means were taken"),
    (check_update_centers, medians, "median"),
    (check_update_centers, over_all, "number of all samples"),
    (check_inertia, lambda s, c: np.sqrt(squared(s, c)).min(axis=1).sum(), "adds up their squares"),
    (check_inertia, lambda s, c: squared(s, c).min(axis=1).mean(), "mean"),
    (check_inertia, lambda s, c: squared(s, c).sum(), "nearest one only"),
    (check_inertia, lambda s, c: math.sqrt(inertia(s, c)), "root"),
    (check_inertia, lambda s, c: np.sqrt(squared(s, c)).min(axis=1).sum() ** 2, "square each distance"),
]


@pytest.mark.parametrize(("check", "mistake", "words"), MISTAKES, ids=[words for _, _, words in MISTAKES])
@pytest.mark.parametrize("more", [0, 20])
def test_usual_mistakes_are_recognised(check, mistake, words, more):
    assert words in answered(check, mistake, more=more)


def test_an_answer_that_changes_its_input_is_told_so():
    def careless(samples, labels, centers):
        result = update_centers(samples, labels, centers)
        labels[:] = 0
        return result

    assert "Work on a copy" in repr(check_update_centers(careless))
