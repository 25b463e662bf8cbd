"""Beyond the paper: prototypes that work along the stairs. Kept apart from the reproduction, and named so.

The paper's robot samples only from its start pose, though it later stands anywhere on a tread; what a jump does from there it never
saw. Here it samples from places along the stairs, sorts by height alone, and keeps what it can bring about from nearly
anywhere. It never looks at a reward.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from stairlab._validation import Seed, finite_number, whole_number
from stairlab.effects import EffectClasses
from stairlab.prototypes import Prototypes, class_agreement, effect_prototypes
from stairlab.sampling import sample_motions
from stairlab.world import World

N_BINS = 11
""" Bins of the height: a prime number, so that the heights of whole steps never fall on the edge of a bin """
LEAST_AGREEMENT = 0.3
""" A class is reliable if some motion's neighbours belong to it in this share or more """
LEAST_EFFECT = 0.1
""" A class has an effect if its mean is this share of the longest class mean, or more """
TUNED_DQN: dict[str, Any] = {
    "learning_rate": 1e-3,
    "learning_starts": 1000,
    "batch_size": 128,
    "gamma": 0.9,
    "target_update_interval": 250,
    "exploration_fraction": 0.5,
    "exploration_final_eps": 0.02,
}
""" DQN settings that fit a task of 30,000 jumps, the same for every set of motions. The published ones copy the target network every
10,000 steps, three times in all, and explore only until learning begins """


def along_stairs_prototypes(
    world: World, n_samples: int = 2000, n: int = 20, seed: Seed = 0, *, feature: str = "dz", progress: bool = False
) -> Prototypes:
    """Find prototypes that have their effect from many places.

    1. Sample motions, each from a place that the world draws (the paper: all from the start pose).
    2. Sort them into histogram classes by one feature of the effect (the paper: K-Means on two).
    3. Keep the classes that have an effect and that some motion brings about reliably (``reliable_counts``).
    4. Place an equal number of prototypes in each, by K-Means among the half of its motions whose neighbours agree most
       (the paper: RGNG among all, their number by equation 2).

    Parameters
    ----------
    world : World
        Where to sample.
    n_samples : int
        Jumps made.
    n : int
        Prototypes in all, at most.
    seed : int or numpy.random.SeedSequence
        Source of all randomness.
    feature : str
        The dimension of the effect.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Prototypes

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described, or no class is reliable.
    """
    samples = sample_motions(world, n_samples, seed, start="drawn", progress=progress)
    classes = EffectClasses.from_samples(samples, (feature,), n_bins=N_BINS, seed=seed)
    return effect_prototypes(
        classes, seed, counts=reliable_counts(classes, n), refine="core", place="k-means", world=world
    )


def reliable_counts(classes: EffectClasses, n: int = 20, least: float = LEAST_AGREEMENT) -> pd.DataFrame:
    """Share prototypes equally among the classes that have an effect and can be brought about reliably.

    Parameters
    ----------
    classes : EffectClasses
        The classes.
    n : int
        Prototypes in all.
    least : float
        Least agreement of a reliable class, 0 to 1 (see ``class_agreement``).

    Returns
    -------
    pandas.DataFrame
        A row for each class: "agreement", whether it has an "effect", and "xi", 0 for a class that is left out.

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described, or no class is reliable.
    """
    n, least = whole_number("n", n, low=1), finite_number("least", least, low=0, high=1)
    agreement = class_agreement(classes)
    length = np.linalg.norm(classes.means, axis=1)
    effect = length >= LEAST_EFFECT * length.max()
    kept = np.flatnonzero(effect & (agreement >= least))
    if not len(kept):
        raise ValueError(
            f"classes must have an effect that some motion brings about in a share of {least:g} of its neighbours, but the best is "
            f"{agreement[effect].max():.2f}. Sample more, or lower the share."
        )
    xi = np.zeros(len(agreement), dtype=int)
    xi[kept] = [len(part) for part in np.array_split(np.arange(n), len(kept))]
    return pd.DataFrame(
        {"agreement": agreement, "effect": effect, "xi": xi}, index=pd.Index(classes.numbers, name="class")
    )
