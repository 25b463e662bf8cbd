"""What the checks of lesson 04 say of solutions, of usual mistakes, and of what else is special to them."""

from functools import partial

import numpy as np
import pytest

from stairlab import davies_bouldin_score, silhouette_samples
from stairlab.checks import check_choose_k, check_davies_bouldin_ratio, check_scale_max_abs, check_silhouette_of

from .verdicts import answered, assert_right


def silhouette_of(i, samples, labels):
    distances = np.linalg.norm(samples - samples[i], axis=1)
    own = labels == labels[i]
    if own.sum() == 1:
        return 0.0
    a = distances[own].sum() / (own.sum() - 1)
    b = min(distances[labels == c].mean() for c in set(labels[~own].tolist()))
    return (b - a) / max(a, b)


def choose_k(ks, scores, tolerance):
    return min(k for k, score in zip(ks, scores, strict=True) if score >= max(scores) - tolerance)


def width(samples):
    return np.linalg.norm(samples - samples.mean(axis=0), axis=1).mean()


def apart(first, second):
    return np.linalg.norm(first.mean(axis=0) - second.mean(axis=0))


def davies_bouldin_ratio(first, second):
    return (width(first) + width(second)) / apart(first, second)


def scale_max_abs(effects):
    largest = np.abs(effects).max(axis=0)
    return effects / np.where(largest > 0, largest, 1)


SOLUTIONS = {
    check_silhouette_of: silhouette_of,
    check_choose_k: choose_k,
    check_davies_bouldin_ratio: davies_bouldin_ratio,
    check_scale_max_abs: scale_max_abs,
}


@pytest.mark.parametrize(("check", "solution"), SOLUTIONS.items())
def test_the_solution_is_right(check, solution):
    assert_right(check, solution)


def test_what_the_library_says_is_right():
    assert check_silhouette_of(lambda i, samples, labels: silhouette_samples(samples, labels)[i], more=20)

    def by_index(first, second):
        labels = [0] * len(first) + [1] * len(second)
        return davies_bouldin_score(np.vstack([first, second]), labels)

    assert check_davies_bouldin_ratio(by_index, more=20)


def varied_silhouette(i, samples, labels, variant):
    distances = np.linalg.norm(samples - samples[i], axis=1) ** (2 if variant == "squared" else 1)
    own = labels == labels[i]
    if own.sum() == 1:
        return {"one": 1.0, "nan": float("nan")}.get(variant, 0.0)
    a = distances[own].mean() if variant == "itself" else distances[own].sum() / (own.sum() - 1)
    means = [distances[labels == c].mean() for c in set(labels[~own].tolist())]
    b = {"nearest": distances[~own].min(), "all": distances[~own].mean(), "far": max(means)}.get(variant, min(means))
    if variant == "sign":
        return (a - b) / max(a, b)
    return b - a if variant == "difference" else (b - a) / max(a, b)


def to_centers(i, samples, labels):
    if (labels == labels[i]).sum() == 1:
        return 0.0
    distances = {c: np.linalg.norm(samples[i] - samples[labels == c].mean(axis=0)) for c in set(labels.tolist())}
    a = distances.pop(labels[i])
    b = min(distances.values())
    return (b - a) / max(a, b)


def good_enough(ks, scores, tolerance):
    return [k for k, score in zip(ks, scores, strict=True) if score >= max(scores) - tolerance]


def not_less(ks, scores, tolerance):
    best = max(scores)
    return min(k for k, score in zip(ks, scores, strict=True) if score == best or score > best - tolerance)


def rms(samples):
    return np.sqrt(((samples - samples.mean(axis=0)) ** 2).sum(axis=1).mean())


def total(samples):
    return np.linalg.norm(samples - samples.mean(axis=0), axis=1).sum()


def no_zero(values):
    return np.where(values == 0, 1, values)


def unguarded(effects):
    with np.errstate(all="ignore"):
        return effects / np.abs(effects).max(axis=0)


MISTAKES = [
    (check_silhouette_of, partial(varied_silhouette, variant="itself"), "count the sample itself"),
    (check_silhouette_of, partial(varied_silhouette, variant="nearest"), "nearest single sample"),
    (check_silhouette_of, partial(varied_silhouette, variant="all"), "all samples of other classes"),
    (check_silhouette_of, partial(varied_silhouette, variant="far"), "largest mean distance"),
    (check_silhouette_of, partial(varied_silhouette, variant="squared"), "squared distances"),
    (check_silhouette_of, partial(varied_silhouette, variant="sign"), "sign is wrong"),
    (check_silhouette_of, partial(varied_silhouette, variant="one"), "has the silhouette 0"),
    (check_silhouette_of, partial(varied_silhouette, variant="nan"), "hence nan"),
    (check_silhouette_of, partial(varied_silhouette, variant="difference"), "larger of a and b"),
    (check_silhouette_of, to_centers, "centres of the classes"),
    (check_choose_k, lambda ks, scores, tolerance: ks[int(np.argmax(scores))], "whatever the tolerance"),
    (check_choose_k, lambda ks, scores, tolerance: ks.index(choose_k(ks, scores, tolerance)), "place in the list"),
    (check_choose_k, lambda ks, scores, tolerance: good_enough(ks, scores, tolerance)[-1], "you return the last one"),
    (check_choose_k, lambda ks, scores, _: good_enough(ks, scores, 0)[-1], "Of equal scores"),
    (
        check_choose_k,
        lambda ks, scores, tolerance: choose_k(ks, [-s for s in scores], tolerance),
        "highest is the best",
    ),
    (check_choose_k, lambda ks, scores, t: min(good_enough(ks, scores, t * max(scores))), "share of the best"),
    (check_choose_k, not_less, "at most, not less than"),
    (check_davies_bouldin_ratio, lambda a, b: (rms(a) + rms(b)) / apart(a, b), "standard deviation"),
    (check_davies_bouldin_ratio, lambda a, b: davies_bouldin_ratio(a, b) / 2, "has their sum"),
    (check_davies_bouldin_ratio, lambda a, b: apart(a, b) / (width(a) + width(b)), "upside down"),
    (
        check_davies_bouldin_ratio,
        lambda a, b: davies_bouldin_ratio(a, b) / apart(a, b),
        "squared distance of the centres",
    ),
    (
        check_davies_bouldin_ratio,
        lambda a, b: (rms(a) ** 2 + rms(b) ** 2) / apart(a, b),
        "squared distances to the centre",
    ),
    (check_davies_bouldin_ratio, lambda a, b: (total(a) + total(b)) / apart(a, b), "is their mean"),
    (
        check_davies_bouldin_ratio,
        lambda a, b: (width(a) + width(b)) / np.linalg.norm(a[:, None] - b, axis=2).mean(),
        "between the samples",
    ),
    (check_scale_max_abs, unguarded, "nan (0/0)"),
    (check_scale_max_abs, lambda e: e / no_zero(e.max(axis=0)), "np.abs first"),
    (check_scale_max_abs, lambda e: e / np.abs(e).max(), "each column has its own"),
    (check_scale_max_abs, lambda e: e / np.abs(e).max(axis=1)[:, None], "divide each row"),
    (check_scale_max_abs, lambda e: (e - e.min(axis=0)) / no_zero(np.ptp(e, axis=0)), "range from 0 to 1"),
    (check_scale_max_abs, lambda e: e / no_zero(e.std(axis=0)), "You divide by the standard deviation"),
    (check_scale_max_abs, lambda e: (e - e.mean(axis=0)) / no_zero(e.std(axis=0)), "subtract the mean"),
]


@pytest.mark.parametrize(("check", "mistake", "words"), MISTAKES, ids=[words for _, _, words in MISTAKES])
@pytest.mark.parametrize("more", [0, 20])
def test_usual_mistakes_are_recognised(check, mistake, words, more):
    assert words in answered(check, mistake, more=more)


def test_an_answer_that_changes_its_input_is_told_so():
    def careless(effects):
        effects /= no_zero(np.abs(effects).max(axis=0))
        return effects

    assert "Work on a copy" in repr(check_scale_max_abs(careless))
