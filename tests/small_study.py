"""A study of made-up runs, for tests of what is drawn and said about studies."""

import numpy as np
import pandas as pd

from stairlab.results import StudyResults

STEPS = range(500, 30_500, 500)


def made_up(scores, samples=None, quick=False, best_return=12.0):
    """Return results in which each run's curve rises evenly to its score, which it has reached five evaluations before the end.

    ``scores``: for each method the score of each seed. A run ends on the top if its score is 15, else stuck on its step.
    """
    runs, evaluations, motions, episodes = [], [], [], []
    for method, values in scores.items():
        discrete = method != "sac"
        for seed, score in enumerate(values):
            runs.append(
                {"method": method, "seed": seed, "score": float(score), "actions": 2.0 if discrete else np.nan}
                | {"samples": (samples or {}).get(method, 0), "best_return": best_return if discrete else np.nan}
                | {"bound": 15.0 if discrete else np.nan, "proved": False if discrete else None}
                | dict.fromkeys(("exhausted", "expanded", "merged"), False if discrete else None)
                | {"simulated": 100 if discrete else None}
                | {"seconds_set": 1.0, "seconds_training": 2.0, "seconds_planning": 0.5}
                | {
                    "parameters_deciding": 5520 if discrete else 68_100,
                    "parameters_trained": 5520 if discrete else 203_782,
                }
                | {"parameters_with_targets": 11_040 if discrete else 339_464}
                | {"parameters_as_published": 5520 if discrete else 475_146}
            )
            climbed = 15 if score == 15 else 2
            evaluations += [
                (method, seed, step, 0, score * min(i / (len(STEPS) - 5), 1.0), 50, climbed)
                for i, step in enumerate(STEPS, 1)
            ]
            if discrete:
                motions += [(method, seed, 400.0, 80.0, np.nan), (method, seed, 300.0, 75.0, np.nan)]
            y, z = (7.0, 4.55) if climbed == 15 else (1.3, 0.65)
            episodes += [(method, seed, 0, jump, 400.0, 80.0, y, z, climbed, 0.0) for jump in range(1, 8)]
    return StudyResults(
        runs=pd.DataFrame(runs),
        evaluations=pd.DataFrame(
            evaluations, columns=["method", "seed", "step", "episode", "return", "length", "climbed"]
        ),
        motions=pd.DataFrame(motions, columns=["method", "seed", "magnitude", "angle", "class"]),
        episodes=pd.DataFrame(
            episodes, columns=["method", "seed", "episode", "jump", "magnitude", "angle", "y", "z", "steps", "reward"]
        ),
        description={
            "settings": {"total_timesteps": 30_000, "eval_every": 500, "n_samples": 2000, "max_simulated": 100}
            | {
                "world": "plane",
                "rocking": 1.0,
                "friction": 1.0,
                "as_published": False,
                "restitution": None,
                "dqn": {},
                "sac": {},
                "quick": quick,
            },
            "own": {},
            "versions": {"stairlab": "0.1.0"},
        },
    )
