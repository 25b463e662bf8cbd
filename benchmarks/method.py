"""What the method gives over seeds 0 to 9: number of classes by every reading of the paper, merging with x drift, and reliability."""

import argparse
import warnings
from collections.abc import Callable

import numpy as np
import pandas as pd
from tqdm import tqdm

from stairlab import (
    EffectClasses,
    Prototypes,
    Samples,
    StairWorld,
    effect_prototypes,
    random_prototypes,
    reliability,
    sample_motions,
    uniform_prototypes,
)

READINGS: dict[str, dict] = {
    "silhouette, 3..6 (the paper's figures)": {},
    "silhouette, 3..10": {"k_range": (3, 10)},
    "silhouette, 2..10 (the paper's text)": {"preset": "paper-text"},
    "Davies-Bouldin, 3..10, scaled (released code)": {"preset": "released-code"},
    "silhouette, 3..6, x drifts, on (dx, dy, dz)": {"features": ("dx", "dy", "dz")},
}
SETS: dict[str, Callable[[StairWorld, EffectClasses, int], Prototypes]] = {
    "effect (the paper)": lambda world, classes, seed: effect_prototypes(classes, seed, world=world),
    "fixed, five a class": lambda world, classes, seed: effect_prototypes(classes, seed, fixed=5, world=world),
    "effect, nearest-effect for xi = 1": lambda world, classes, seed: effect_prototypes(
        classes, seed, single="nearest-effect", world=world
    ),
    **{
        f"effect, refine={refine!r}": lambda world, classes, seed, refine=refine: effect_prototypes(
            classes, seed, refine=refine, world=world
        )
        for refine in ("nearest", "central", "agreeing", "core")
    },
    "uniform": lambda world, classes, seed: uniform_prototypes(world),
    "random": lambda world, classes, seed: random_prototypes(world, seed=seed),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="number of seeds (default: 10)")
    seeds = range(parser.parse_args().seeds)
    world = StairWorld()
    numbers: dict[str, list[int]] = {name: [] for name in READINGS}
    six, rows = 0, []
    for seed in tqdm(seeds, desc="seeds", leave=False):
        samples = sample_motions(world, seed=seed, progress=False)
        drifting = sample_motions(StairWorld(x_drift=True), seed=seed, progress=False)
        for name, reading in READINGS.items():
            numbers[name].append(_classes(drifting if "drift" in name else samples, seed, **reading).n_classes)
        classes = _classes(samples, seed)
        six += np.round(classes.means[:, 1] / world.staircase.rise).tolist() == [0, 0, 1, 2, 3, 4]
        for name, make in SETS.items():
            prototypes = make(world, classes, seed)
            measured = reliability(world, prototypes, classes, seed)
            rows.append(
                {
                    "set": name,
                    "prototypes": len(prototypes),
                    "exact": measured.exact,
                    "under noise": measured.noisy,
                    "on map": measured.on_map,
                    "classes reached": measured.classes_reached,
                }
            )
    print(f"Six classes, two on the ground and one for each step: {six} of {len(seeds)} seeds\n")
    print("Number of classes, seed by seed")
    print(pd.Series({name: " ".join(map(str, counts)) for name, counts in numbers.items()}).to_string())
    print(f"\nReliability, mean over {len(seeds)} seeds")
    print(pd.DataFrame(rows).groupby("set", sort=False).mean().round(3).to_string())


def _classes(samples: Samples, seed: int, **reading: object) -> EffectClasses:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return EffectClasses.from_samples(samples, seed=seed, **reading)  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
