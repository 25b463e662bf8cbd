"""Algorithm 2 of the paper, effect region clustering: samples whose effects are alike form an effect class."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import pandas as pd

from stairlab._validation import Seed, finite_array, one_of, seed_sequence, whole_number
from stairlab.clustering import HistogramBins, KMeans, davies_bouldin_score, silhouette_scores
from stairlab.sampling import Samples

OFF_THE_MAP = 0
""" Label of a sample that is left out of the clustering; classes are numbered from 1, as in the paper """

PRESETS: dict[str, dict[str, Any]] = {
    "paper-figures": {"criterion": "silhouette", "k_range": (3, 6), "scaling": "none"},
    "paper-text": {"criterion": "silhouette", "k_range": (2, 10), "scaling": "none"},
    "released-code": {"criterion": "davies-bouldin", "k_range": (3, 10), "scaling": "max-abs"},
}
""" The three readings of the paper: what gives its figures, what its text says (psi = 10), what the authors' released package does """


class _Clusterer(Protocol):
    labels_: np.ndarray

    def predict(self, X: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class EffectClasses:
    """The effect classes C_1 to C_k of a set of samples (Algorithm 2). Made by ``EffectClasses.from_samples``.

    Classes are ordered by the length of their mean effect, ties by the first effect dimension, so that equal clusterings have equal
    numbers whatever the order in which they were found.

    Attributes
    ----------
    samples : Samples
        The samples, all that were given.
    features : tuple of str
        The effect dimensions that were clustered.
    labels : ndarray of shape (n_samples,), int
        Class of each sample, from 1; 0 for a sample that ended off the map and takes no part.
    means, stds : ndarray of shape (n_classes, n_features)
        Mean and standard deviation (ddof = 1; 0 for a class of one sample) of the effects of each class, in the effects' units.
    sizes : ndarray of shape (n_classes,), int
        Number of samples in each class.
    scores : pandas.DataFrame
        The score of each k that was tried: columns "k" and "score"; empty for histogram classes.
    settings : dict
        How the classes were made.
    """

    samples: Samples
    features: tuple[str, ...]
    labels: np.ndarray
    means: np.ndarray
    stds: np.ndarray
    sizes: np.ndarray
    scores: pd.DataFrame
    settings: dict[str, Any]
    _model: _Clusterer = field(repr=False)
    _scale: np.ndarray = field(repr=False)
    _number_of: np.ndarray = field(repr=False)

    @classmethod
    def from_samples(
        cls,
        samples: Samples,
        features: Sequence[str] = ("dy", "dz"),
        preset: str = "paper-figures",
        *,
        criterion: str | None = None,
        k_range: tuple[int, int] | None = None,
        scaling: str | None = None,
        n_init: int = 10,
        n_bins: int = 10,
        seed: Seed = 0,
    ) -> EffectClasses:
        r"""Group samples by their effects (Algorithm 2).

        One effect dimension: equal-width histogram bins, empty ones dropped. More: K-Means for each k of a range; the first k
        with the best score wins.

        Parameters
        ----------
        samples : Samples
            Only those that ended on the map are clustered.
        features : sequence of str
            Effect dimensions, such as ("dy", "dz").
        preset : {"paper-figures", "paper-text", "released-code"}
            A reading of the paper, for what is not given below.
        criterion : {"silhouette", "davies-bouldin"}, optional
            The score that chooses k: highest silhouette, or lowest Davies-Bouldin index.
        k_range : (int, int), optional
            Smallest and largest k, both tried (the largest is the paper's psi).
        scaling : {"none", "max-abs"}, optional
            Cluster the effects in their units, or each dimension divided by its largest absolute value.
        n_init : int
            Starts of K-Means for each k.
        n_bins : int
            Bins of the histogram.
        seed : int or numpy.random.SeedSequence
            For K-Means; each k has a child of its own.

        Returns
        -------
        EffectClasses

        Raises
        ------
        ValueError, TypeError
            If an argument is not as described, no sample is on the map, or there are fewer distinct effects than classes.
        """
        if not isinstance(samples, Samples):
            raise TypeError(f"samples must be Samples, as sample_motions returns them, not {type(samples).__name__}.")
        reading = PRESETS[one_of("preset", preset, PRESETS)]
        features = _feature_names(features, samples)
        scaling = one_of("scaling", reading["scaling"] if scaling is None else scaling, ("none", "max-abs"))
        criterion = reading["criterion"] if criterion is None else criterion
        criterion = one_of("criterion", criterion, ("silhouette", "davies-bouldin"))
        ks = _range_of(reading["k_range"] if k_range is None else k_range)
        n_init, n_bins = whole_number("n_init", n_init, low=1), whole_number("n_bins", n_bins, low=1)
        on_map = samples.on_the_map()
        effects = finite_array("samples on the map", on_map.effect(*features), min_rows=2)
        scale = np.abs(effects).max(axis=0) if scaling == "max-abs" else np.ones(len(features))
        scale[scale == 0] = 1.0
        settings: dict[str, Any] = {"features": list(features), "scaling": scaling}
        if len(features) == 1 and not np.ptp(effects):
            raise ValueError(
                f"samples must have different effects, but all on the map have {features[0]} = {effects[0, 0]:g}."
            )
        if len(features) == 1:
            model: _Clusterer = HistogramBins(n_bins=n_bins).fit(effects / scale)
            scores = pd.DataFrame({"k": [], "score": []})
            settings |= {"method": "histogram", "n_bins": n_bins}
        else:
            model, scores = _best_kmeans(effects / scale, ks, criterion, n_init, seed)
            settings |= {"method": "k-means", "criterion": criterion, "k_range": [ks[0], ks[-1]], "n_init": n_init}
        number_of = _numbers(effects, model.labels_)
        labels = np.full(len(samples), OFF_THE_MAP)
        labels[samples.on_map] = number_of[model.labels_]
        members = [effects[number_of[model.labels_] == number] for number in range(1, len(number_of) + 1)]
        return cls(
            samples=samples,
            features=features,
            labels=labels,
            means=np.array([member.mean(axis=0) for member in members]),
            stds=np.array([member.std(axis=0, ddof=1) if len(member) > 1 else 0 * member[0] for member in members]),
            sizes=np.array([len(member) for member in members]),
            scores=scores,
            settings=settings,
            _model=model,
            _scale=scale,
            _number_of=number_of,
        )

    def __repr__(self) -> str:
        return f"EffectClasses({self.n_classes} classes of {len(self.samples)} samples by {', '.join(self.features)})"

    @property
    def n_classes(self) -> int:
        """Number of classes."""
        return len(self.sizes)

    @property
    def numbers(self) -> range:
        """Numbers of the classes, from 1."""
        return range(1, self.n_classes + 1)

    def motions_of(self, number: int) -> np.ndarray:
        """Return the action A_k: the motions of all samples of a class, shape (size, n_motion_parameters)."""
        return self.samples.motions[self.labels == whole_number("number", number, low=1, high=self.n_classes)]

    def predict(self, effects: np.ndarray) -> np.ndarray:
        """Return the class of each effect.

        Parameters
        ----------
        effects : array-like of shape (n, n_features)
            In the clustered dimensions.

        Returns
        -------
        ndarray of shape (n,), int
            Numbers from 1.

        Raises
        ------
        ValueError
            If the effects are not finite or have another shape.
        """
        effects = finite_array("effects", effects, columns=len(self.features))
        return self._number_of[self._model.predict(effects / self._scale)]

    def nearest_mean(self, effects: np.ndarray) -> np.ndarray:
        """Return the class whose mean effect is nearest to each effect, shape (n,), from 1 (the rule of ``reliability``)."""
        effects = finite_array("effects", effects, columns=len(self.features))
        return 1 + np.linalg.norm(effects[:, None] - self.means, axis=2).argmin(axis=1)

    def reached(self, samples: Samples) -> np.ndarray:
        """Return the class that each of some other jumps reached, shape (n,): that of the nearest mean effect, 0 off the map."""
        return np.where(samples.on_map, self.nearest_mean(samples.effect(*self.features)), OFF_THE_MAP)

    def to_frame(self) -> pd.DataFrame:
        """Return a table with a row for each class: size, mean and standard deviation of each effect dimension."""
        columns = {f"mean {name}": self.means[:, i] for i, name in enumerate(self.features)}
        columns |= {f"std {name}": self.stds[:, i] for i, name in enumerate(self.features)}
        return pd.DataFrame({"size": self.sizes, **columns}, index=pd.Index(self.numbers, name="class"))


def _feature_names(features: Sequence[str], samples: Samples) -> tuple[str, ...]:
    if not isinstance(features, (str, list, tuple)):
        raise TypeError(f"features must be names of effect dimensions, such as ('dy', 'dz'), not {features!r}.")
    names = (features,) if isinstance(features, str) else tuple(features)
    for name in names:
        one_of("features", name, samples.effect_names)
    if not names or len(set(names)) < len(names):
        raise ValueError(f"features must be one or more different effect dimensions, not {names}.")
    return names


def _range_of(k_range: tuple[int, int]) -> range:
    try:
        low, high = k_range
    except (TypeError, ValueError):
        raise ValueError(f"k_range must be the smallest and the largest k, such as (3, 6), not {k_range!r}.") from None
    low = whole_number("k_range[0]", low, low=2)
    return range(low, whole_number("k_range[1]", high, low=low) + 1)


def _best_kmeans(X: np.ndarray, ks: range, criterion: str, n_init: int, seed: Seed) -> tuple[KMeans, pd.DataFrame]:
    if len(X) <= ks[-1]:
        raise ValueError(f"k_range must end below {len(X)}, the number of samples on the map, not at {ks[-1]}.")
    if (distinct := len(np.unique(X, axis=0))) < ks[-1]:
        raise ValueError(
            f"k_range must end at {distinct} or below, as there are {distinct} distinct effects, not at {ks[-1]}."
        )
    children = seed_sequence(seed, "effect classes").spawn(ks[-1] + 1)
    models = [KMeans(n_clusters=k, n_init=n_init, random_state=children[k]).fit(X) for k in ks]
    labelings = [model.labels_ for model in models]
    if criterion == "silhouette":
        scores = silhouette_scores(X, labelings)
        best = int(np.argmax(scores))
    else:
        scores = np.array([davies_bouldin_score(X, labels) for labels in labelings])
        best = int(np.argmin(scores))
    return models[best], pd.DataFrame({"k": list(ks), "score": scores})


def _numbers(effects: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return the class number of each cluster: by the length of the mean effect, ties by the first dimension."""
    means = np.array([effects[labels == label].mean(axis=0) for label in range(labels.max() + 1)])
    order = np.lexsort((means[:, 0], np.linalg.norm(means, axis=1)))
    return np.argsort(order) + 1
