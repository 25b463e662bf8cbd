"""The command stairlab."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pandas as pd
import pytest

from stairlab import Prototypes, Samples, Staircase, StairWorld, roll_out
from stairlab.cli import _records, main
from stairlab.fidelity import TREAD_COLUMNS


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with samples.csv and prototypes.csv, made by the command."""
    folder = tmp_path_factory.mktemp("cli")
    assert main(["sample", "--n", "300", "--seed", "5", "--output", str(folder / "samples.csv")]) == 0
    assert main(["prototypes", str(folder / "samples.csv"), "--output", str(folder / "prototypes.csv")]) == 0
    return folder


@pytest.fixture(autouse=True)
def warnings_shown_as_before(monkeypatch):
    import warnings

    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)


def run(*arguments, capsys):
    status = main([str(argument) for argument in arguments])
    return status, *capsys.readouterr()


def test_sample_writes_the_published_columns(folder, capsys):
    samples = Samples.from_csv(folder / "samples.csv")
    assert len(samples) == 300
    status, out, _ = run("sample", "--n", 300, "--seed", 5, "--output", folder / "again.csv", "--json", capsys=capsys)
    assert status == 0
    assert (folder / "again.csv").read_bytes() == (folder / "samples.csv").read_bytes()
    said = json.loads(out)
    assert said["jumps"] == 300
    assert said["on the map"] == samples.on_map.sum()


def test_prototypes_prints_every_step_of_the_method_and_writes_the_set(folder, capsys):
    status, out, _ = run("prototypes", folder / "samples.csv", capsys=capsys)
    assert status == 0
    for part in ("scores", "classes", "counts", "prototypes", "mean dy", "xi"):
        assert part in out
    prototypes = Prototypes.from_csv(folder / "prototypes.csv")
    assert prototypes.method == "effect"
    assert 3 <= prototypes.classes.max() <= 6


def test_prototypes_as_json_are_those_of_the_file(folder, capsys):
    _, out, _ = run("prototypes", folder / "samples.csv", "--json", capsys=capsys)
    table = pd.DataFrame(json.loads(out)["prototypes"])
    written = Prototypes.from_csv(folder / "prototypes.csv")
    np.testing.assert_allclose(table[["magnitude", "angle"]], written.motions)


def test_options_reach_the_method(folder, capsys):
    _, out, _ = run("prototypes", folder / "samples.csv", "--k-range", 3, 3, "--fixed", 2, "--json", capsys=capsys)
    said = json.loads(out)
    assert len(said["classes"]) == 3
    assert len(said["prototypes"]) <= 6
    status, out, _ = run("prototypes", folder / "samples.csv", "--features", "dy", "--json", capsys=capsys)
    assert status == 0
    assert json.loads(out)["scores"] == []


def test_replay_shows_the_effect_of_each_motion(folder, capsys):
    status, out, _ = run("replay", folder / "prototypes.csv", "--json", capsys=capsys)
    effects = pd.DataFrame(json.loads(out)["effects"])
    assert status == 0
    assert len(effects) == len(Prototypes.from_csv(folder / "prototypes.csv"))
    assert {"magnitude", "angle", "class", "dy", "dz", "on map"} <= set(effects)


def test_replay_takes_any_table_of_motions_and_any_number_of_steps(folder, capsys):
    (folder / "mine.csv").write_text("magnitude,angle\n330,70\n")
    _, out, _ = run("replay", folder / "mine.csv", "--steps", 1, "--output", folder / "effects.csv", capsys=capsys)
    assert "0.300" in out
    assert pd.read_csv(folder / "effects.csv")["dz"][0] == pytest.approx(0.3, abs=1e-3)


FIDELITY = ["n", "agreement", "dy_error_median_mm", "dy_error_p90_mm", "gap_ks"]
FIDELITY += ["agreement_se", "n_climbing", "agreement_climbing", "agreement_climbing_se", "climbing"]


def test_fidelity_of_own_jumps_is_perfect_in_the_plane_and_has_both_worlds_as_json(folder, capsys):
    status, out, _ = run("fidelity", folder / "samples.csv", "--json", capsys=capsys)
    assert status == 0
    said = json.loads(out)
    assert list(said) == [*FIDELITY, "tumbling", "plane"]
    assert {name: said[name] for name in FIDELITY} == said["plane"]
    assert (said["agreement"], said["agreement_climbing"], said["gap_ks"]) == (1, 1, 0)
    assert said["plane"]["climbing"]["share_turned"] == {"recorded": 0, "replayed": 0}
    assert 0.9 < said["tumbling"]["agreement"] < 1
    assert said["tumbling"]["climbing"]["share_turned"]["replayed"] > 0.1


def test_fidelity_of_one_world_draws_from_its_seed(folder, capsys):
    figures = []
    for seed in (3, 3, 4):
        arguments = ("fidelity", folder / "samples.csv", "--world", "tumbling", "--seed", seed, "--json")
        status, out, _ = run(*arguments, capsys=capsys)
        assert status == 0
        figures.append(json.loads(out))
    assert list(figures[0]) == [*FIDELITY, "tumbling"]
    assert {name: figures[0][name] for name in FIDELITY} == figures[0]["tumbling"]
    assert figures[0] == figures[1] != figures[2]


@pytest.fixture(scope="module")
def treads(folder):
    """Return a file of the plane's own rollouts."""
    rolled = roll_out(StairWorld(Staircase.fifteen()), 8, seed=1, progress=False)
    columns = [rolled.rollout, rolled.jump, rolled.motions, rolled.starts, rolled.ends]
    pd.DataFrame(np.column_stack(columns), columns=list(TREAD_COLUMNS)).to_csv(folder / "treads.csv", index=False)
    return folder / "treads.csv"


def test_fidelity_on_treads_measures_both_worlds(treads, capsys):
    status, out, _ = run("fidelity", "--treads", treads, "--rollouts", 8, "--seed", 1, "--json", capsys=capsys)
    assert status == 0
    said = json.loads(out)
    assert list(said) == ["reference", "tumbling", "plane"]
    distances = dict.fromkeys(["gap_ks", "yaw_ks", "x_ks"], 0)
    again = {"outcomes_again": said["reference"]["outcomes_by_motion"]}
    assert said["plane"] == distances | said["reference"] | again
    assert said["tumbling"]["yaw_ks"] > 0.5
    assert len(said["reference"]["climb_by_gap"]) == 6
    assert [row["yaw"] for row in said["reference"]["climb_by_yaw"]][-1] == "20 to 45°"


def test_fidelity_takes_both_files_at_once(folder, treads, capsys):
    arguments = ("fidelity", folder / "samples.csv", "--treads", treads, "--world", "plane", "--rollouts", 3)
    status, out, _ = run(*arguments, "--json", capsys=capsys)
    assert status == 0
    said = json.loads(out)
    assert list(said) == [*FIDELITY, "plane", "treads"]
    assert list(said["treads"])[-2:] == ["reference", "plane"]
    assert said["treads"]["gap_ks"] == said["treads"]["plane"]["gap_ks"] > 0
    assert said["treads"]["n_rollouts"] == 3


def test_fidelity_shows_tables_and_draws_a_figure_of_each_file(folder, treads, capsys):
    arguments = ("fidelity", folder / "samples.csv", "--treads", treads, "--rollouts", 3)
    status, out, err = run(*arguments, "--figure", folder / "both.png", capsys=capsys)
    assert status == 0
    for part in (
        "recorded     ",
        "300 recorded jumps, replayed",
        "same outcome class, jumps that climb [%]",
        "tumbling: recorded (rows) against replayed (columns)",
        "reference ",
        "gap: KS distance",
        "highest step of a rollout, quartiles",
        "10 to 15 cm",
        "20 to 45°",
    ):
        assert part in out
    for name in ("both.png", "both_treads.png"):
        assert (folder / name).read_bytes()[:4] == b"\x89PNG"
        assert f"figure in {folder / name}" in err


@pytest.mark.slow
def test_what_run_wrote_can_be_made_again_step_by_step_with_the_same_seed(folder, capsys):
    assert main(["run", "--n", "300", "--seed", "5", "--out", str(folder / "whole")]) == 0
    assert (folder / "whole" / "samples.csv").read_bytes() == (folder / "samples.csv").read_bytes()
    again = ["prototypes", str(folder / "samples.csv"), "--seed", "5", "--output", str(folder / "again.csv")]
    assert main(again) == 0
    assert (folder / "whole" / "prototypes_effect.csv").read_bytes() == (folder / "again.csv").read_bytes()


def test_numbers_that_json_does_not_know_become_null():
    table = pd.DataFrame({"a": [np.nan, np.inf, 1.5], "b": [1, 2, 3], "c": ["x", None, "z"]})
    assert json.loads(json.dumps(_records(table), allow_nan=False)) == [
        {"a": None, "b": 1, "c": "x"},
        {"a": None, "b": 2, "c": None},
        {"a": 1.5, "b": 3, "c": "z"},
    ]


def test_an_absurd_file_is_refused_and_nothing_hangs(folder, capsys):
    lines = (folder / "samples.csv").read_text().splitlines()
    cells = lines[3].split(",")
    for column, value in (("dz", "1e300"), ("env_z", "5000"), ("magnitude", "-5")):
        bad = cells.copy()
        bad[lines[0].split(",").index(column)] = value
        (folder / "absurd.csv").write_text("\n".join([*lines[:3], ",".join(bad), *lines[4:]]))
        status, _, err = run("fidelity", folder / "absurd.csv", "--json", capsys=capsys)
        assert status == 2
        assert err.count("\n") == 1


def test_fidelity_draws_a_figure(folder, capsys):
    arguments = ("fidelity", folder / "samples.csv", "--world", "plane", "--figure", folder / "fidelity.png")
    status, out, _ = run(*arguments, capsys=capsys)
    assert status == 0
    assert "100.00 ± 0.00" in out
    assert "tumbling" not in out
    assert (folder / "fidelity.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.slow
def test_run_writes_figures_tables_and_the_report(folder, capsys):
    status, out, _ = run("run", "--n", 200, "--out", folder / "out", "--json", capsys=capsys)
    assert status == 0
    names = {row["method"] for row in json.loads(out)["summary"]}
    assert {"effect (the paper)", "effect, fixed 5", "uniform", "random"} <= names
    assert (folder / "out" / "report.html").stat().st_size > 10_000
    assert len(list((folder / "out").glob("figure_*.png"))) == 6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["sample", "--n", "0"], "n must be at least 1, not 0."),
        (["sample", "--n", "50", "--distribution", "grid"], "such as 49, not 50."),
        (["sample", "--seed", "-1"], "seed must be at least 0, not -1."),
        (["sample", "--jobs", "0"], "n_jobs must be a number of processes"),
        (["sample", "--steps", "0"], "n_steps must be between 1 and 200, not 0."),
        (["sample", "--output", "nowhere/samples.csv"], "the folder nowhere must exist"),
        (["sample", "--output", "."], "is a folder; name a file"),
        (["replay", "missing.csv"], "missing.csv: No such file or directory"),
        (["fidelity", "bad.csv", "--json"], "bad.csv, line 1: the columns"),
        (["fidelity"], "name a FILE of recorded jumps, or one of recorded rollouts with --treads FILE, or both"),
        (["fidelity", "--treads", "bad.csv"], "bad.csv, line 1: the columns rollout, jump, magnitude"),
        (["fidelity", "--treads", "missing.csv"], "missing.csv: No such file or directory"),
        (["fidelity", "--treads", "bad.csv", "--seed", "-1"], "seed must be at least 0, not -1."),
        (["fidelity", "--treads", "bad.csv", "--rollouts", "0"], "rollouts must be at least 1, not 0."),
        (["prototypes", "bad.csv"], "bad.csv, line 1: the columns"),
        (["replay", "outside.csv"], "but row 1 is magnitude 2000, angle 45."),
        (["run", "--out", "bad.csv"], "bad.csv is a file; name a folder"),
    ],
)
def test_an_input_error_is_one_line_and_status_two(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n")
    (tmp_path / "outside.csv").write_text("magnitude,angle\n2000,45\n")
    status, out, err = run(*arguments, capsys=capsys)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "arguments", [[], ["dance"], ["sample", "--n", "many"], ["replay"], ["prototypes", "a.csv", "--refine", "x"]]
)
def test_a_usage_error_is_one_line_and_status_two(arguments, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "--help" in err


@pytest.mark.parametrize("command", ["run", "sample", "prototypes", "replay", "fidelity", "published", "study"])
def test_every_command_has_help_with_an_example(command, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([command, "--help"])
    assert stopped.value.code == 0
    out = capsys.readouterr().out
    assert f"example: stairlab {command}" in out
    assert "--json" in out


@pytest.mark.slow
def test_a_warning_is_a_note_on_one_line(folder):
    command = [sys.executable, "-m", "stairlab.cli", "prototypes", str(folder / "samples.csv"), "--features", "dz"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert done.stderr
    assert all(line.startswith("stairlab: note: ") for line in done.stderr.splitlines())


@pytest.mark.slow
def test_ctrl_c_ends_with_130_and_leaves_no_file(tmp_path):
    command = [sys.executable, "-m", "stairlab.cli", "sample", "--n", "100000", "--output", str(tmp_path / "s.csv")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    time.sleep(4)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_reader_that_stops_early_is_no_error(folder):
    command = f"{sys.executable} -m stairlab.cli replay {folder / 'prototypes.csv'} | true"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_importing_stairlab_loads_nothing_heavy():
    code = (
        "import sys, stairlab; print(sorted({'torch', 'pymunk', 'numba', 'pandas', 'matplotlib'} & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ})
    assert out.stdout.strip() == "[]"


def test_every_public_name_can_be_imported_from_stairlab():
    import stairlab

    for name in dir(stairlab):
        if not name.startswith("_"):
            assert getattr(stairlab, name).__doc__
    assert set(stairlab.__all__) <= set(dir(stairlab))
    with pytest.raises(AttributeError, match="no attribute 'stairs'"):
        stairlab.stairs  # noqa: B018
