import dataclasses

import numpy as np
import pandas as pd
import pytest
from small_run import ARGUMENTS, pictures, small_run

from stairlab import report
from stairlab.effects import PRESETS, EffectClasses
from stairlab.pipeline import METHODS, RESAMPLES, _counts, run_pipeline, together
from stairlab.report import save_run
from stairlab.sampling import Samples


def test_a_run_has_all_sets_all_presets_and_all_samples() -> None:
    run = small_run()
    assert len(run.samples) == run.n == 300
    assert list(run.presets) == list(PRESETS)
    assert run.classes is run.presets["paper-figures"]
    assert list(METHODS) == list(run.prototypes) == list(run.reliability)
    assert len(run.merges) == RESAMPLES


def test_equal_seeds_give_equal_bits() -> None:
    first, second = small_run(), run_pipeline(**ARGUMENTS)
    for name in METHODS:
        np.testing.assert_array_equal(first.prototypes[name].motions, second.prototypes[name].motions)
        pd.testing.assert_frame_equal(first.reliability[name].table, second.reliability[name].table, check_exact=True)
    pd.testing.assert_frame_equal(first.merges, second.merges)
    pd.testing.assert_frame_equal(first.scores(), second.scores(), check_exact=True)
    np.testing.assert_array_equal(first.samples.effects, second.samples.effects)


def test_the_drifting_jumps_are_the_same_jumps_but_for_x() -> None:
    run = small_run()
    np.testing.assert_array_equal(run.classes_x.samples.effect("dy", "dz"), run.samples.effect("dy", "dz"))
    assert np.ptp(run.classes_x.samples.effect("dx")) > 0.1
    assert not run.samples.effect("dx").any()


def test_the_summary_says_what_was_measured() -> None:
    run = small_run()
    table = run.summary()
    assert list(table) == ["method", "prototypes", "exact", "under noise", "on map", "classes reached"]
    assert table["prototypes"].tolist() == [len(prototypes) for prototypes in run.prototypes.values()]
    assert table["exact"][0] == run.reliability["effect"].exact
    assert table.loc[table["exact"].isna(), "method"].tolist() == ["uniform", "random"]


def test_scores_mark_one_chosen_k_for_each_preset() -> None:
    run = small_run()
    chosen = run.scores().query("chosen").set_index("preset")["k"]
    assert chosen.to_dict() == {name: classes.n_classes for name, classes in run.presets.items()}


def test_classes_that_share_another_class_are_named_together() -> None:
    classes = small_run().classes
    assert together(classes, classes) == ", ".join(f"C{number}" for number in classes.numbers)
    two = EffectClasses.from_samples(small_run().samples, k_range=(2, 2))
    groups = [group.split("+") for group in together(classes, two).split(", ")]
    assert len(groups) == 2
    assert sorted(name for group in groups for name in group) == [f"C{number}" for number in classes.numbers]


def test_a_warning_about_the_counts_becomes_a_note() -> None:
    notes: list[str] = []
    counts = _counts(EffectClasses.from_samples(small_run().samples, "dz"), notes)
    assert "xi" in counts
    assert any("jitter" in note or "coefficient of variation" in note for note in notes)


def test_a_tiny_run_works_too_and_another_seed_gives_other_motions() -> None:
    run = run_pipeline(n=12, seed=3, replays=3, progress=False)
    assert len(run.summary()) == len(METHODS)
    assert not np.array_equal(run.samples.motions, small_run().samples.motions[:12])
    assert not np.array_equal(run.prototypes["random"].motions, small_run().prototypes["random"].motions)


def test_too_few_jumps_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"n must be larger: 1 of 1 jumps|n must be larger: 0 of 1 jumps"):
        run_pipeline(n=1, progress=False)
    with pytest.raises(ValueError, match="n must be at least 1, not 0"):
        run_pipeline(n=0)
    with pytest.raises(TypeError, match="seed must be a whole number"):
        run_pipeline(seed=1.5)


@pytest.fixture
def _drawn_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let reports use the pictures that were drawn for other tests."""
    monkeypatch.setattr(report, "draw_figures", lambda *_: pictures())


@pytest.mark.usefixtures("_drawn_before")
@pytest.mark.slow
def test_save_writes_tables_figures_and_report(tmp_path) -> None:
    run = small_run()
    files = save_run(run, tmp_path / "new" / "out", progress=False)
    assert sorted(path.name for path in files) == sorted(path.name for path in (tmp_path / "new" / "out").iterdir())
    assert {path.name for path in files} >= {
        "samples.csv", "effect_classes.csv", "prototype_counts.csv", "prototypes_effect.csv", "prototypes_fixed.csv",
        "prototypes_uniform.csv", "prototypes_random.csv", "reliability.csv", "scores.csv", "figure_1_world.png", "report.html",
    }  # fmt: skip
    np.testing.assert_array_equal(
        Samples.from_csv(tmp_path / "new" / "out" / "samples.csv").effects, run.samples.effects
    )
    written = pd.read_csv(tmp_path / "new" / "out" / "reliability.csv")
    pd.testing.assert_frame_equal(written, run.summary())


@pytest.mark.usefixtures("_drawn_before")
def test_a_save_that_fails_half_way_leaves_only_whole_files(tmp_path) -> None:
    run = dataclasses.replace(small_run(), versions={})  # the report asks for the version at its end
    with pytest.raises(Exception, match="stairlab"):
        save_run(run, tmp_path, progress=False)
    names = {path.name for path in tmp_path.iterdir()}
    assert "figure_1_world.png" in names
    assert "report.html" not in names
    assert not any(name.startswith(".") for name in names)


def test_in_three_dimensions_the_same_jumps_have_their_own_sideways_effects() -> None:
    run = run_pipeline(n=300, seed=0, replays=2, progress=False, world="tumbling")
    assert type(run.world).__name__ == "TumblingWorld"
    assert run.classes_x.samples is run.samples
    assert np.ptp(run.samples.effect("dx")) > 0.1
    with pytest.raises(ValueError, match="world must be one of 'plane', 'tumbling', not 'space'"):
        run_pipeline(n=300, world="space")
