"""Studies: run, killed and gone on with, damaged, shared, spread out; all trainings are of some hundred steps."""

import asyncio
import contextlib
import errno
import hashlib
import json
import os
import pickle
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import joblib
import numpy as np
import pandas as pd
import pytest
from filelock import FileLock

from stairlab import (
    EffectClasses,
    Prototypes,
    Staircase,
    StairWorld,
    Study,
    StudyResults,
    effect_prototypes,
    sample_motions,
)
from stairlab import study as study_module
from stairlab.agents import PACKAGES, train
from stairlab.cli import main
from stairlab.cluster import dask_cluster
from stairlab.results import CHECKSUMS, STUDY_FILE, damage
from stairlab.study import BEYOND, METHODS, Settings, motion_set

SHORT = {
    "world": "plane",
    "total_timesteps": 200,
    "eval_every": 100,
    "n_samples": 300,
    "max_simulated": 100,
    "dqn": {"learning_starts": 50},
    "sac": {"learning_starts": 50, "batch_size": 32},
}
SAME = ("evaluations.csv", "episode.csv", "motions.csv")
""" What a run must give to the bit; run.json also has times """


def short_study(folder, methods=("uniform", "random"), seeds=(0, 1), **settings):
    return Study(methods, seeds, out_dir=folder, **(SHORT | settings))


def make(folder, *arguments, n_jobs=1, **settings):
    return short_study(folder, *arguments, **settings).run(n_jobs, progress=False)


def runs(folder):
    """Return the names of the finished runs of a study's folder."""
    return sorted(path.parent.name for path in Path(folder).glob("[!.]*/run.json"))


def contents(folder):
    """Return all that must not depend on how a study was made: the tables of each run, and its record without times."""
    found = {}
    for name in runs(folder):
        assert damage(Path(folder) / name) is None
        record = json.loads((Path(folder) / name / "run.json").read_bytes())
        del record["seconds"]
        tables = {path.name: path.read_bytes() for path in Path(folder, name).iterdir() if path.name in SAME}
        found[name] = (record, tables)
    return found


def identities(folder):
    """Return what changes when a run is made anew."""
    return {name: (Path(folder) / name / "run.json").stat()[1:2] + times(folder, name) for name in runs(folder)}


def times(folder, name):
    return tuple(path.stat().st_mtime_ns for path in sorted(Path(folder, name).iterdir()))


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    """Return the folder of a small study; it is copied, never changed."""
    folder = tmp_path_factory.mktemp("study") / "original"
    make(folder)
    return folder


@pytest.fixture
def copied(original, tmp_path):
    return shutil.copytree(original, tmp_path / "copied")


@pytest.fixture(scope="module")
def every_method(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "every"
    return folder, make(folder, list(METHODS), [3])


@pytest.fixture
def no_training(monkeypatch):
    """Let a run that begins to train fail, with these words."""

    def refuse(*_, **__):
        raise AssertionError("nothing must be trained")

    monkeypatch.setattr(study_module, "train", refuse)


def own_set(path, *motions):
    path.write_text("magnitude,angle\n" + "".join(f"{magnitude},{angle}\n" for magnitude, angle in motions))
    return path


# What a study leaves


def test_a_run_is_a_folder_with_its_record_its_tables_and_their_checksums(original):
    assert runs(original) == ["random-0", "random-1", "uniform-0", "uniform-1"]
    for name in runs(original):
        files = {path.name: path.read_bytes() for path in (original / name).iterdir()}
        assert set(files) == {"run.json", *SAME, CHECKSUMS}
        sums = dict(reversed(line.split()) for line in files.pop(CHECKSUMS).decode().splitlines())
        assert sums == {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    assert not list(original.glob(".*.part"))


def test_a_record_says_what_was_run_with_which_settings_and_versions(original):
    record = json.loads((original / "random-1" / "run.json").read_bytes())
    assert (record["method"], record["seed"], record["algorithm"], record["actions"]) == ("random", 1, "dqn", 10)
    assert SHORT.items() <= record["settings"].items()
    assert set(PACKAGES) <= set(record["versions"])
    assert record["set"] == {"n": 10}
    assert record["plan"]["value"] <= record["plan"]["bound"] <= 15
    assert json.loads((original / STUDY_FILE).read_bytes()) == {"settings": record["settings"], "own": {}}


def test_results_have_every_run_evaluation_and_motion(original):
    results = short_study(original).results()
    assert list(zip(results.runs["method"], results.runs["seed"], strict=True)) == [
        ("uniform", 0),
        ("uniform", 1),
        ("random", 0),
        ("random", 1),
    ]
    assert results.evaluations.groupby(["method", "seed"])["step"].apply(list).tolist() == [[100, 200]] * 4
    assert results.motions.groupby("method").size().to_dict() == {"random": 2 * 10, "uniform": 2 * 16}
    for name in runs(original):
        method, _, seed = name.partition("-")
        stored = pd.read_csv(original / name / "evaluations.csv")
        row = results.runs[(results.runs["method"] == method) & (results.runs["seed"] == int(seed))]
        assert row["score"].item() == pytest.approx(stored["return"].mean())


def test_the_last_greedy_episode_ends_where_the_evaluation_says(original):
    for name in runs(original):
        episode = pd.read_csv(original / name / "episode.csv")
        evaluation = pd.read_csv(original / name / "evaluations.csv").iloc[-1]
        motions = pd.read_csv(original / name / "motions.csv")
        assert episode["jump"].tolist() == list(range(1, int(evaluation["length"]) + 1))
        assert episode["reward"].sum() == pytest.approx(evaluation["return"])
        assert episode["steps"].iloc[-1] == evaluation["climbed"]
        assert set(episode["magnitude"]) <= set(motions["magnitude"])


def test_a_second_run_of_the_same_study_makes_nothing(copied, no_training):
    before = identities(copied)
    assert len(make(copied).runs) == 4
    assert identities(copied) == before


def test_methods_and_seeds_may_join_a_study(copied):
    before = identities(copied)
    results = make(copied, ["fixed", "uniform"], [1, 2])
    assert runs(copied) == sorted([*before, "fixed-1", "fixed-2", "uniform-2"])
    assert {name: identities(copied)[name] for name in before} == before
    assert sorted(zip(results.runs["method"], results.runs["seed"], strict=True)) == [
        ("fixed", 1),
        ("fixed", 2),
        ("uniform", 1),
        ("uniform", 2),
    ]


@pytest.mark.slow
def test_every_method_runs_and_has_as_many_motions_as_it_should(every_method):
    folder, results = every_method
    assert runs(folder) == sorted(f"{method}-3" for method in METHODS)
    tables = {method: pd.read_csv(folder / f"{method}-3" / "motions.csv") for method in METHODS if method != "sac"}
    counts = {method: len(table) for method, table in tables.items()}
    assert counts["random"] == 10
    assert counts["uniform"] == 16
    assert counts["random-matched"] == counts["uniform-matched"] == counts["effect"]
    for method in ("effect", "effect-reliable", "fixed"):
        classes = tables[method]["class"].value_counts()
        assert sorted(classes.index) == list(range(1, len(classes) + 1))
        assert 3 <= len(classes) <= 6
    assert tables["fixed"]["class"].value_counts().max() <= 5
    assert not (folder / "sac-3" / "motions.csv").exists()
    assert results.runs.set_index("method")["samples"].to_dict() == {
        method: 300 if method in ("effect", "effect-reliable", "fixed") else 0 for method in METHODS
    }


@pytest.mark.slow
def test_the_stored_seeds_give_the_samples_the_set_and_the_training_again(every_method):
    folder, _ = every_method
    record = json.loads((folder / "effect-3" / "run.json").read_bytes())
    children = {name: np.random.SeedSequence(**child) for name, child in record["children"].items()}
    assert [child.generate_state(4).tolist() for child in children.values()] == [
        child.generate_state(4).tolist() for child in np.random.SeedSequence(3).spawn(4)
    ]
    world = StairWorld(Staircase())
    samples = sample_motions(world, SHORT["n_samples"], children["sampling"], progress=False)
    classes = EffectClasses.from_samples(samples, seed=children["prototypes"])
    prototypes = effect_prototypes(classes, children["prototypes"], world=world)
    stored = pd.read_csv(folder / "effect-3" / "motions.csv")
    assert record["set"] == prototypes.settings
    assert json.loads((folder / "sac-3" / "run.json").read_bytes())["set"] is None
    np.testing.assert_array_equal(stored[["magnitude", "angle"]], prototypes.motions)
    budget = {name: SHORT[name] for name in ("total_timesteps", "eval_every")}
    again = train("dqn", prototypes, children["training"], progress=False, **budget, **SHORT["dqn"])
    pd.testing.assert_frame_equal(pd.read_csv(folder / "effect-3" / "evaluations.csv"), again.evaluations)


@pytest.fixture(scope="module")
def tumbling(tmp_path_factory):
    """A study of a discrete method and SAC where cubes tumble."""
    folder = tmp_path_factory.mktemp("tumbling") / "study"
    return folder, make(folder, ["random", "sac"], [0, 1], world="tumbling")


@pytest.mark.slow
def test_where_cubes_tumble_evaluations_and_last_episodes_are_five_each_and_the_same_in_any_process(tumbling, tmp_path):
    folder, results = tumbling
    assert results.evaluations.groupby(["method", "seed", "step"])["episode"].nunique().eq(5).all()
    assert results.episodes.groupby(["method", "seed"])["episode"].nunique().eq(5).all()
    assert (results.episodes.query("method == 'sac'")["action"] == -1).all()
    assert results.episodes["yaw"].between(-45, 45).all()
    make(tmp_path / "two", ["sac", "random"], [1, 0], n_jobs=2, world="tumbling")
    assert contents(tmp_path / "two") == contents(folder)


@pytest.mark.slow
def test_a_study_goes_on_from_tables_and_refuses_those_of_another(tumbling, tmp_path):
    _, results = tumbling
    results.selected(["random"], [0]).save_tables(tmp_path / "tables")
    known = StudyResults.load(tmp_path / "tables")
    again = short_study(tmp_path / "study", ["random", "sac"], known=known, world="tumbling").run(1, progress=False)
    assert runs(tmp_path / "study") == ["random-1", "sac-0", "sac-1"]
    for name in ("evaluations", "motions", "episodes"):
        pd.testing.assert_frame_equal(getattr(again, name), getattr(results, name), check_dtype=False)
    with pytest.raises(ValueError, match="known holds another study: world is 'tumbling' there and 'plane' here"):
        short_study(tmp_path / "plane", known=known)
    with pytest.raises(TypeError, match="known must be StudyResults, not str"):
        short_study(tmp_path / "plane", known="tables")


@pytest.mark.parametrize("method", BEYOND)
def test_each_set_beyond_the_papers_can_be_made_in_both_worlds(method):
    for world in ("plane", "tumbling"):
        motions = motion_set(method, 0, Settings(n_samples=400, world=world)).motions
        assert 4 <= len(motions) <= 30
        assert np.isin([600.0, 89.0], motions).all() == (method == "effect-plus-steep")
    if method == "uniform-no-corners":
        assert len(motions) == 12
    if method == "uniform-shifted":
        assert len(motions) == 16
        assert not np.array_equal(motions, motion_set(method, 1).motions)


def test_as_published_one_set_made_from_samples_serves_all_seeds_and_random_ones_are_drawn_anew():
    settings = Settings(n_samples=400, as_published=True)
    first, second = (motion_set("effect", seed, settings).motions for seed in (1, 2))
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(*(motion_set("random", seed, settings).motions for seed in (1, 2)))


def test_settings_of_the_other_world_are_refused():
    with pytest.raises(ValueError, match="The plane world has no rocking, but it is 0"):
        Settings(world="plane", rocking=0.5)
    with pytest.raises(ValueError, match="no restitution in the tumbling world"):
        Settings(restitution=0.5)
    with pytest.raises(ValueError, match="world must be one of 'plane', 'tumbling', not 'space'"):
        Settings(world="space")


def test_the_seeds_of_sampling_sets_and_training_are_independent(original):
    states = []
    for name in ("uniform-0", "uniform-1", "random-1"):
        children = json.loads((original / name / "run.json").read_bytes())["children"]
        assert list(children) == ["sampling", "prototypes", "training", "episodes"]
        states += [tuple(np.random.SeedSequence(**child).generate_state(4).tolist()) for child in children.values()]
    assert len(set(states)) == 8
    assert states[4:8] == states[8:]  # a seed's are the same for each method


@pytest.mark.slow
def test_another_restitution_is_another_study_with_other_jumps(original, tmp_path):
    make(tmp_path / "hard", ["uniform"], [0], restitution=0.6)
    one, other = contents(original)["uniform-0"], contents(tmp_path / "hard")["uniform-0"]
    assert one[1]["motions.csv"] == other[1]["motions.csv"]
    assert one[1]["episode.csv"] != other[1]["episode.csv"]
    with pytest.raises(ValueError, match=r"restitution is 0\.6 there and None here"):
        short_study(tmp_path / "hard")


@pytest.mark.slow
def test_prototypes_from_along_the_stairs_can_take_part(tmp_path):
    results = make(tmp_path / "study", ["along-stairs", "uniform"], [0], n_samples=400)
    assert runs(tmp_path / "study") == ["along-stairs-0", "uniform-0"]
    stored = pd.read_csv(tmp_path / "study" / "along-stairs-0" / "motions.csv")
    np.testing.assert_array_equal(
        stored[["magnitude", "angle"]], motion_set("along-stairs", 0, Settings(n_samples=400, world="plane")).motions
    )
    assert results.runs.set_index("method")["samples"].to_dict() == {"along-stairs": 400, "uniform": 0}


def test_runs_made_with_other_versions_are_told_of_once_and_kept(copied, monkeypatch, no_training):
    here = study_module.package_versions()
    monkeypatch.setattr(study_module, "package_versions", lambda: {**here, "torch": "99.0"})
    before = identities(copied)
    with pytest.warns(UserWarning, match=f"torch is {re.escape(here['torch'])} there and 99.0 here") as told:
        make(copied)
    assert len(told) == 1
    assert "numpy" not in str(told[0].message)
    assert identities(copied) == before


# However it is spread


@pytest.mark.slow
def test_results_depend_neither_on_the_order_nor_on_the_processes(every_method, tmp_path):
    folder, _ = every_method
    make(tmp_path / "two", list(reversed(METHODS)), [3], n_jobs=2)
    assert contents(tmp_path / "two") == contents(folder)


@pytest.mark.slow
def test_results_do_not_depend_on_threads_that_share_a_process(every_method, tmp_path):
    folder, _ = every_method
    with joblib.parallel_config("threading"):
        make(tmp_path / "threads", ["sac", "random", "uniform"], [3], n_jobs=2)
    expected = contents(folder)
    assert contents(tmp_path / "threads") == {name: expected[name] for name in ("random-3", "sac-3", "uniform-3")}


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:
        yield cluster


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_files(cluster, every_method, tmp_path):
    folder, _ = every_method
    with cluster.get_client() as client:
        assert len(client.run(os.getpid)) == 2
        with joblib.parallel_config("dask", client=client):
            make(tmp_path / "dask", list(METHODS), [3], n_jobs=-1)
        counts = client.run_on_scheduler(
            lambda dask_scheduler: {
                name: prefix.state_counts["memory"] for name, prefix in dask_scheduler.task_prefixes.items()
            }
        )
    assert contents(tmp_path / "dask") == contents(folder)
    # no run has handed on parts of itself: its worker would begin another one while it waits
    assert sum(count for name, count in counts.items() if name.startswith("batch")) == len(METHODS)


# Killed, shared, damaged, full

SCRIPT = """
import sys
from stairlab import study

store = study._store

def store_and_tell(folder, files):
    store(folder, files)
    print(folder.name, flush=True)

study._store = store_and_tell
out, methods, seeds, n_jobs, settings = eval(sys.argv[1])
made = study.Study(methods, seeds, out_dir=out, **settings)
print("ready", flush=True)
sys.stdin.readline()
made.run(n_jobs, progress=False)
"""
MANY = (["uniform", "random", "fixed"], [0, 1, 2])


def begin(folder, n_jobs):
    """Start a study in a process group of its own, as a shell does; it waits for a line."""
    arguments = repr((str(folder), *MANY, n_jobs, SHORT))
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", SCRIPT, arguments], start_new_session=True, text=True, **pipes)
    assert process.stdout.readline() == "ready\n"
    return process


def wait_until(condition):
    """Wait; the test's time limit catches what never comes."""
    while not condition():
        time.sleep(0.005)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "uninterrupted"
    make(folder, *MANY)
    return contents(folder)


@pytest.mark.slow
def test_a_killed_study_goes_on_where_it_was_and_ends_with_the_same_numbers(uninterrupted, tmp_path):
    folder = tmp_path / "killed"
    process = begin(folder, n_jobs=2)
    process.stdin.write("\n")
    process.stdin.flush()
    wait_until(lambda: len(runs(folder)) >= 2)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    assert len(runs(folder)) < len(uninterrupted)
    for part in (".random-2.part", ".fixed-2.part"):  # as if it had also been killed while it wrote
        (folder / part).mkdir(exist_ok=True)
        (folder / part / "run.json").write_text('{"meth')
    before = identities(folder)
    told, said = begin(folder, n_jobs=1).communicate("\n")
    assert said == ""
    assert sorted([*before, *told.split()]) == sorted(uninterrupted)
    assert {name: identities(folder)[name] for name in before} == before
    assert contents(folder) == uninterrupted
    assert not list(folder.glob(".*.part"))


@pytest.mark.slow
def test_two_processes_on_one_folder_share_the_runs(uninterrupted, tmp_path):
    processes = [begin(tmp_path / "shared", n_jobs=1) for _ in range(2)]
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    outcomes = [process.communicate() for process in processes]
    assert [process.returncode for process in processes] == [0, 0]
    assert [said for _, said in outcomes] == ["", ""]
    assert sorted("".join(told for told, _ in outcomes).split()) == sorted(uninterrupted)  # each made once
    assert contents(tmp_path / "shared") == uninterrupted


def test_a_run_that_another_process_has_begun_is_left_to_it_and_made_when_it_gave_up(original, tmp_path, monkeypatch):
    monkeypatch.setattr(study_module, "POLL_TIME", 0.01)
    folder = tmp_path / "shared"
    folder.mkdir()
    lock = FileLock(folder / ".uniform-0.lock")
    with lock:
        thread = threading.Thread(target=make, args=(folder,))
        thread.start()
        wait_until(lambda: len(runs(folder)) == 3)
        assert "uniform-0" not in runs(folder)
        assert thread.is_alive()
    thread.join()
    assert contents(folder) == contents(original)


def flip_a_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def cut_off(path):
    os.truncate(path, path.stat().st_size // 2)


def cut_off_a_line(path):
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))


@pytest.mark.parametrize("name", ["run.json", "evaluations.csv", "motions.csv", CHECKSUMS])
@pytest.mark.parametrize("spoil", [flip_a_bit, cut_off, cut_off_a_line, Path.unlink])
def test_a_damaged_run_is_noticed_reported_and_made_anew(spoil, name, original, copied):
    before = identities(copied)
    spoil(copied / "random-1" / name)
    with pytest.warns(UserWarning, match=r"random-1 is damaged \(.*\) and is made anew") as told:
        make(copied)
    assert len(told) == 1
    assert contents(copied) == contents(original)
    assert [run for run, identity in identities(copied).items() if identity != before[run]] == ["random-1"]


@contextlib.contextmanager
def full_disk(folder):
    """Mount a small disk at a folder, and return a function that fills it."""
    folder.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", folder], capture_output=True).returncode:
        pytest.skip("Mounting a small disk needs rights that this process does not have.")

    @contextlib.contextmanager
    def filled():
        with open(folder / ".filler", "wb", buffering=0) as file, contextlib.suppress(OSError):
            while True:
                file.write(bytes(4096))
        yield
        (folder / ".filler").unlink()

    try:
        yield filled
    finally:
        subprocess.run(["umount", folder], check=True)


@contextlib.contextmanager
def small_files(_):
    """Return a function that lets no file grow beyond 700 bytes: checksums fit, a run's record does not."""
    resource = pytest.importorskip("resource")

    @contextlib.contextmanager
    def limited():
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (700, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    yield limited


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has neither.")
@pytest.mark.parametrize(
    ("trouble", "code"), [(full_disk, errno.ENOSPC), (small_files, errno.EFBIG)], ids=["disk full", "file too large"]
)
def test_a_file_that_cannot_be_written_is_named_and_all_before_is_kept(trouble, code, original, tmp_path):
    folder = tmp_path / "disk"
    with trouble(folder) as in_trouble:
        make(folder, ["uniform"], [0, 1])
        before = identities(folder)
        with in_trouble(), pytest.raises(OSError, match=r"\.random-0\.part") as error:
            make(folder)
        assert error.value.errno == code
        assert Path(error.value.filename).parent == folder / ".random-0.part"
        assert Path(error.value.filename).name in ("run.json", *SAME)
        assert identities(folder) == before
        assert sorted(path.name for path in folder.iterdir() if path.is_dir()) == ["uniform-0", "uniform-1"]
        make(folder)
        assert contents(folder) == contents(original)
        assert {name: identities(folder)[name] for name in before} == before


@pytest.mark.slow
def test_after_an_error_the_same_process_can_go_on(original, tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device", "run.json")

    with monkeypatch.context() as patch:
        patch.setattr(study_module, "_store", fail)
        with pytest.raises(OSError, match=r"run\.json"):
            make(tmp_path / "study", n_jobs=2)
    assert runs(tmp_path / "study") == []
    make(tmp_path / "study", n_jobs=2)
    assert contents(tmp_path / "study") == contents(original)


@pytest.mark.slow
def test_a_run_that_cannot_be_made_names_itself_from_another_process_too(tmp_path):
    with pytest.raises(RuntimeError, match=r"The run effect-[01] could not be made: .*samples"):
        make(tmp_path / "study", ["effect"], n_samples=1, n_jobs=2)
    assert runs(tmp_path / "study") == []


def test_a_run_that_cannot_be_made_names_itself_and_says_why(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise KeyError("the reason")

    monkeypatch.setattr(study_module, "train", fail)
    with pytest.raises(RuntimeError, match="The run random-3 could not be made: 'the reason'") as error:
        make(tmp_path / "study", ["random"], [3])
    assert isinstance(error.value.__cause__, KeyError)
    assert str(pickle.loads(pickle.dumps(error.value))) == str(error.value)


@pytest.mark.parametrize("error", [OSError(errno.EMFILE, "Too many open files"), MemoryError(), KeyboardInterrupt()])
def test_what_is_no_fault_of_the_run_stays_as_it_is(error, tmp_path, monkeypatch):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(study_module, "train", fail)
    with pytest.raises(type(error)) as raised:
        make(tmp_path / "study", ["random"], [3])
    assert raised.value is error


# Bad input


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"methods": ["uniform", "magic"]}, ValueError, "methods must be of effect, .* not 'magic'"),
        ({"methods": "uniform"}, TypeError, r"methods must be several, such as \['effect', 'uniform'\], not 'uniform'"),
        ({"methods": None}, TypeError, "methods must be several, .* not None"),
        ({"methods": [5]}, ValueError, "methods must be of effect, .* not '5'"),
        ({"methods": ["mine="]}, ValueError, "'mine=' must name the set's file, such as 'mine=motions.csv'"),
        ({"seeds": 5}, TypeError, r"seeds must be several, such as range\(6\), not 5"),
        ({"seeds": "0-4"}, TypeError, r"seeds must be several, such as range\(6\), not '0-4'"),
        ({"methods": []}, ValueError, r"methods must be one or more, all different, not \[\]"),
        ({"methods": ["sac", "sac"]}, ValueError, "methods must be one or more, all different"),
        ({"seeds": []}, ValueError, r"seeds must be one or more, all different, not \[\]"),
        ({"seeds": [1, 1]}, ValueError, "seeds must be one or more, all different"),
        ({"seeds": [0, -1]}, ValueError, "a seed must be at least 0, not -1"),
        ({"seeds": [0.5]}, TypeError, "a seed must be a whole number, not 0.5"),
        ({"total_timesteps": 0}, ValueError, "total_timesteps must be at least 1, not 0"),
        ({"total_timesteps": 99}, ValueError, r"eval_every must be at most total_timesteps \(99\).* not 100"),
        ({"n_samples": 0}, ValueError, "n_samples must be at least 1"),
        ({"max_simulated": True}, TypeError, "max_simulated must be a whole number"),
        ({"restitution": 1.5}, ValueError, "restitution must be between 0 and 1, not 1.5"),
        ({"learning_rate": 1}, TypeError, "learning_rate"),
        ({"dqn": 5}, TypeError, r"dqn must be a dict of settings, such as \{'gamma': 0.9\}, not 5"),
        ({"dqn": {"gama": 0.9}}, ValueError, "dqn has no setting 'gama'; did you mean 'gamma'?"),
        ({"sac": {"exploration_fraction": 0.5}}, ValueError, "sac has no setting 'exploration_fraction'"),
        ({"sac": {"seed": 1}}, ValueError, "sac has no setting 'seed'"),
        ({"dqn": {"learning_starts": "many"}}, TypeError, "learning_starts must be a whole number, not 'many'"),
        ({"dqn": {"learning_rate": abs}}, TypeError, "cannot be written as JSON"),
        ({"quick": "yes"}, TypeError, "quick must be True or False, not 'yes'"),
    ],
)
def test_bad_arguments_are_refused_before_a_folder_is_made(arguments, error, message, tmp_path):
    with pytest.raises(error, match=message):
        short_study(tmp_path / "study", **arguments)
    assert not (tmp_path / "study").exists()


def test_methods_and_seeds_may_come_from_generators(tmp_path):
    study = short_study(tmp_path, (name for name in ("random", "sac")), (seed for seed in (3, 1)))
    assert (study.methods, study.seeds) == (["random", "sac"], [3, 1])


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (("magic", 0), ValueError, "method must be one of 'effect', .*, 'along-stairs', not 'magic'"),
        (("random", -1), ValueError, "seed must be at least 0, not -1"),
    ],
)
def test_a_set_that_cannot_be_made_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        motion_set(*arguments)


def test_no_processes_are_refused_before_a_folder_is_made(tmp_path):
    with pytest.raises(ValueError, match="n_jobs must be a number of processes, or -1 for all cores, not 0"):
        make(tmp_path / "study", n_jobs=0)
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize(
    ("name", "motions", "message"),
    [
        ("mine", "", "must hold a line of column names and at least one row"),
        ("mine", "magnitude,angle\n", "must hold a line of column names and at least one row"),
        ("mine", "magnitude,angle\n500,45\n500,45\n", "'mine' cannot be used: .* more than once"),
        ("mine", "magnitude,angle\n500,95\n", "mine"),
        ("mine", "force,angle\n500,45\n", "the column magnitude must be there"),
        ("uniform", "magnitude,angle\n500,45\n", "not one of effect, .*; not 'uniform'"),
        ("Uniform", "magnitude,angle\n500,45\n", "not one of effect, .*; not 'Uniform'"),
        ("../mine", "magnitude,angle\n500,45\n", "a name of letters, digits, - and _"),
        ("", "magnitude,angle\n500,45\n", "a name of letters, digits, - and _"),
    ],
)
def test_a_set_of_ones_own_must_be_usable_and_have_a_name_of_its_own(name, motions, message, tmp_path):
    (tmp_path / "mine.csv").write_text(motions)
    with pytest.raises(ValueError, match=message):
        short_study(tmp_path / "study", [f"{name}={tmp_path / 'mine.csv'}"])
    assert not (tmp_path / "study").exists()


def test_a_set_of_ones_own_is_run_as_it_is(tmp_path):
    path = own_set(tmp_path / "mine.csv", (330, 70), (600.5, 60), (400, 75))
    make(tmp_path / "study", [f"mine={path}"], [0])
    assert runs(tmp_path / "study") == ["mine-0"]
    stored = Prototypes.from_csv(tmp_path / "study" / "mine-0" / "motions.csv")
    np.testing.assert_array_equal(stored.motions, [[330, 70], [600.5, 60], [400, 75]])
    with pytest.raises(FileNotFoundError):
        short_study(tmp_path / "study", [f"mine={tmp_path / 'missing.csv'}"])


def test_other_motions_of_the_same_name_are_another_study(tmp_path, no_training):
    folder = tmp_path / "study"
    first, second = own_set(tmp_path / "a.csv", (330, 70)), own_set(tmp_path / "b.csv", (330, 71))
    with pytest.raises(RuntimeError, match="mine-0 could not be made: nothing must be trained"):
        make(folder, [f"mine={first}"])
    with pytest.raises(ValueError, match="holds another study: the motions 'mine' differ"):
        make(folder, [f"mine={second}"])
    with pytest.raises(RuntimeError, match="other-0 could not be made: nothing must be trained"):
        make(folder, [f"other={second}"])
    assert json.loads((folder / STUDY_FILE).read_bytes())["own"].keys() == {"mine", "other"}


def test_a_folder_with_another_study_is_refused(copied, no_training):
    before = identities(copied)
    with pytest.raises(ValueError, match=r"total_timesteps is 200 there and 300 here.* Name another folder"):
        make(copied, seeds=[7], total_timesteps=300)
    with pytest.raises(ValueError, match="quick is False there and True here"):
        make(copied, seeds=[7], quick=True)
    assert identities(copied) == before


def test_another_study_that_came_in_between_is_refused(tmp_path, no_training):
    late = short_study(tmp_path / "study", total_timesteps=300)
    with pytest.raises(RuntimeError, match="nothing must be trained"):
        make(tmp_path / "study")
    with pytest.raises(ValueError, match="total_timesteps is 200 there and 300 here"):
        late.run(1, progress=False)


def test_a_folder_that_is_no_study_is_refused(tmp_path, no_training):
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(ValueError, match=r"must be new, empty, or hold a study, but .* holds other files"):
        make(tmp_path)
    with pytest.raises(ValueError, match=r"out_dir must be a folder, but .*thesis\.tex is a file"):
        make(tmp_path / "thesis.tex")
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"settings": 1, "own": {}}'])
def test_a_study_file_that_does_not_say_which_study_it_is_is_refused(content, copied, no_training):
    (copied / STUDY_FILE).write_text(content)
    with pytest.raises(ValueError, match=r"study\.json is damaged"):
        make(copied, seeds=[7])


def test_a_quick_study_is_marked_and_its_budgets_can_be_set(tmp_path):
    short = {name: value for name, value in SHORT.items() if name != "dqn"}
    study = Study.quick(["uniform"], [0], out_dir=tmp_path / "quick", **(short | {"total_timesteps": 100}))
    assert study.settings.quick
    assert study.settings.total_timesteps == 100
    assert study.settings.dqn == {"learning_starts": 300}
    assert Study.quick(out_dir=tmp_path / "quick", dqn={"gamma": 0.9}).settings.dqn == {"gamma": 0.9}
    assert study.run(1, progress=False).quick
    assert json.loads((tmp_path / "quick" / "uniform-0" / "run.json").read_bytes())["settings"]["quick"] is True
    with pytest.raises(ValueError, match="quick is True there and False here"):
        short_study(tmp_path / "quick")


# The command


@pytest.fixture(autouse=True)
def warnings_shown_as_before(monkeypatch):
    import warnings

    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)


def command(*arguments, capsys):
    status = main(["study", *map(str, arguments)])
    return status, *capsys.readouterr()


class Recorded(Exception):
    """Carries what the command would have made."""


@pytest.fixture
def asked(monkeypatch, tmp_path, capsys):
    """Return a function that runs the command and returns the study that it would have run, and in how many processes."""
    monkeypatch.chdir(tmp_path)

    def record(study, n_jobs=-1):
        raise Recorded(study, n_jobs)

    monkeypatch.setattr(Study, "run", record)

    def ask(*arguments):
        with pytest.raises(Recorded) as recorded:
            command(*arguments, capsys=capsys)
        return recorded.value.args

    return ask


@pytest.mark.parametrize(
    ("given", "seeds"),
    [
        (["0-3"], [0, 1, 2, 3]),
        (["0", "1", "2"], [0, 1, 2]),
        (["0-2", "7"], [0, 1, 2, 7]),
        (["100-100", "3"], [100, 3]),
    ],
)
def test_seeds_are_numbers_and_ranges(given, seeds, asked):
    assert asked("--seeds", *given)[0].seeds == seeds


def test_without_options_the_command_runs_all_methods_at_paper_scale(asked):
    study, n_jobs = asked()
    assert (study.methods, study.seeds, n_jobs) == (list(METHODS), [0, 1, 2, 3, 4, 5], -1)
    assert str(study.out_dir) == "study"
    assert study.settings == study_module.Settings()
    assert study.settings.total_timesteps == 30_000


def test_options_reach_the_study(asked, tmp_path):
    own_set(tmp_path / "mine.csv", (330, 70))
    study, n_jobs = asked(
        "--methods",
        "sac",
        "mine=mine.csv",
        "--timesteps",
        1000,
        "--jobs",
        3,
        "--world",
        "plane",
        "--restitution",
        0.2,
        "--out",
        "there",
    )
    assert (study.methods, n_jobs, str(study.out_dir)) == (["sac", "mine"], 3, "there")
    assert (study.settings.total_timesteps, study.settings.eval_every) == (1000, 500)
    assert study.settings.restitution == 0.2
    quick, _ = asked("--quick")
    assert quick.settings.quick
    assert (quick.settings.total_timesteps, str(quick.out_dir)) == (2000, "study-quick")
    assert quick.seeds == [0, 1]
    assert asked("--quick", "--timesteps", 150)[0].settings.eval_every == 150


def test_a_study_made_by_several_commands_is_shown_whole(tmp_path, monkeypatch, capsys):
    saved = []
    monkeypatch.setattr("stairlab.study_report.save_study", lambda results, _: saved.append(results))
    options = ["--quick", "--timesteps", 200, "--jobs", 1, "--out", tmp_path / "study", "--json"]
    own = own_set(tmp_path / "mine.csv", (330, 70), (400, 75))
    command("--methods", "uniform", "random", "--seeds", 0, *options, capsys=capsys)
    status, out, _ = command("--methods", f"mine={own}", "--seeds", 1, 2, *options, capsys=capsys)
    assert status == 0
    assert [(row["method"], row["seeds"]) for row in json.loads(out)["summary"]] == [
        ("uniform", 1),
        ("random", 1),
        ("mine", 2),
    ]
    assert saved[1].methods == ["uniform", "random", "mine"]
    assert saved[1].description["own"].keys() == {"mine"}


@pytest.mark.slow
def test_the_command_prints_the_summary_and_leaves_tables_figures_and_report(tmp_path, capsys):
    options = ["--methods", "uniform", "--seeds", "0-1", "--timesteps", 200, "--jobs", 1, "--out", tmp_path / "out"]
    status, out, _ = command(*options, capsys=capsys)
    assert status == 0
    assert "quick study" not in out
    assert re.search(r"^ *method +seeds", out, re.MULTILINE)
    assert re.search(r"^ *uniform +2 ", out, re.MULTILINE)
    assert runs(tmp_path / "out") == ["uniform-0", "uniform-1"]
    assert (tmp_path / "out" / "report.html").stat().st_size > 1000
    before = identities(tmp_path / "out")
    status, out, _ = command(*options, "--json", capsys=capsys)  # with its own report in the folder, it goes on
    assert status == 0
    assert [(row["method"], row["seeds"]) for row in json.loads(out)["summary"]] == [("uniform", 2)]
    assert identities(tmp_path / "out") == before


@pytest.mark.slow
def test_a_quick_study_says_so_in_its_first_line(tmp_path, capsys):
    options = [
        "--quick",
        "--methods",
        "uniform",
        "--seeds",
        0,
        "--timesteps",
        200,
        "--jobs",
        1,
        "--out",
        tmp_path / "q",
    ]
    status, out, _ = command(*options, capsys=capsys)
    assert status == 0
    assert "this is a quick study" in out.splitlines()[0]
    assert "say nothing about the paper" in out.splitlines()[0]
    status, out, _ = command(*options, "--json", capsys=capsys)
    assert status == 0
    assert "this is a quick study" in next(iter(json.loads(out).values()))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--methods", "magic"], "methods must be of effect"),
        (["--methods", "mine=missing.csv"], "missing.csv: No such file or directory"),
        (["--timesteps", "0"], "total_timesteps must be at least 1, not 0."),
        (["--seeds", "0-2", "1"], "seeds must be one or more, all different"),
        (["--jobs", "0"], "n_jobs must be a number of processes"),
        (["--world", "plane", "--restitution", "2"], "restitution must be between 0 and 1, not 2."),
        (["--out", "thesis.tex"], "thesis.tex is a file; name a folder"),
        (["--out", "."], "out_dir must be new, empty, or hold a study, but . holds other files."),
        (["--dask", "somewhere"], "such as tcp://host:8786, not 'somewhere': missing port number"),
        (["--dask", "http://host:8786"], "such as tcp://host:8786, not 'http://host:8786': unknown address scheme"),
        (["--dask", "tcp://host:port"], "such as tcp://host:8786, not 'tcp://host:port': "),
    ],
)
def test_an_input_error_is_one_line_and_status_two(arguments, message, tmp_path, monkeypatch, capsys, no_training):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "thesis.tex").write_text("precious")
    status, out, err = command(*arguments, capsys=capsys)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("seeds", ["-1", "3-1", "0-", "a", "1.5", "0-99999999999", "1,2", ""])
def test_what_is_no_seed_is_a_usage_error_of_one_line(seeds, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["study", "--seeds", seeds])
    assert stopped.value.code == 2
    err = capsys.readouterr().err
    assert "--seeds" in err
    assert err.count("\n") == 1


def test_help_names_every_method_and_has_an_example(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["study", "--help"])
    assert stopped.value.code == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "example: stairlab study" in out
    assert ", ".join(METHODS) in out


@pytest.mark.slow
def test_the_command_runs_on_a_dask_cluster(cluster, tmp_path, capsys):
    options = ["--methods", "uniform", "--seeds", "0-1", "--timesteps", 200]
    assert command(*options, "--dask", cluster.scheduler_address, "--out", tmp_path / "dask", capsys=capsys)[0] == 0
    assert command(*options, "--jobs", 1, "--out", tmp_path / "here", capsys=capsys)[0] == 0
    assert contents(tmp_path / "dask") == contents(tmp_path / "here")
    assert runs(tmp_path / "dask") == ["uniform-0", "uniform-1"]


def test_a_cluster_can_be_asked_for_where_an_event_loop_runs_as_in_jupyter(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("stairlab.cluster.DASK_TIMEOUT", 0.2)

    async def ask():
        with dask_cluster("tcp://127.0.0.1:1"):
            raise AssertionError("nobody is there")

    with pytest.raises(OSError, match="no Dask scheduler answers at tcp://127"):
        asyncio.run(ask())


@pytest.mark.slow
def test_a_cluster_can_be_used_where_an_event_loop_runs_as_in_jupyter(cluster):
    async def spread():
        with dask_cluster(cluster.scheduler_address):
            return joblib.Parallel()(joblib.delayed(abs)(number) for number in (-1, -2))

    assert asyncio.run(spread()) == [1, 2]


@pytest.mark.slow
def test_workers_with_other_versions_are_refused(cluster, tmp_path, monkeypatch, capsys):
    from distributed import Client

    get_versions = Client.get_versions

    def with_another_torch(client, **options):
        found = get_versions(client, **options)
        next(iter(found["workers"].values()))["packages"]["torch"] = "1.0"
        return found

    monkeypatch.setattr(Client, "get_versions", with_another_torch)
    status, _, err = command("--dask", cluster.scheduler_address, "--out", tmp_path / "out", capsys=capsys)
    assert status == 2
    assert "has torch 1.0 where this process has" in err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_scheduler_that_is_none_or_has_no_workers_is_an_error_of_one_line(tmp_path, monkeypatch, capsys):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("stairlab.cluster.DASK_TIMEOUT", 1)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        status, _, err = command("--dask", address, "--out", tmp_path / "out", capsys=capsys)
        assert (status, err.count("\n")) == (2, 1)
        assert f"no Dask scheduler answers at {address}" in err
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0") as cluster:
        status, _, err = command("--dask", cluster.scheduler_address, "--out", tmp_path / "out", capsys=capsys)
        assert (status, err.count("\n")) == (2, 1)
        assert "the scheduler has no workers; start some with: dask worker" in err


@pytest.mark.parametrize(
    ("missing", "arguments", "extra"),
    [
        ("torch", ["--quick"], "stairlab[rl]"),
        ("filelock", ["--quick"], "stairlab[rl]"),
        ("distributed", ["--dask", "tcp://127.0.0.1:1"], "stairlab[cluster]"),
    ],
)
def test_a_missing_extra_is_named(missing, arguments, extra, tmp_path):
    code = f"import sys; sys.modules[{missing!r}] = None; from stairlab.cli import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", code, "study", *arguments], capture_output=True, text=True, cwd=tmp_path, timeout=120
    )
    assert done.returncode == 2
    assert f"pip install '{extra}'" in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_the_results_of_a_study_can_be_imported_without_the_extra_rl():
    code = "import sys; from stairlab import StudyResults; sys.exit(bool({'torch', 'filelock'} & set(sys.modules)))"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)
