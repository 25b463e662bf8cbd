"""The command ``stairlab``: the paper's pipeline, whole (``run``) or step by step, and its learning study, on the terminal."""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    import pandas as pd

    from stairlab.fidelity import Fidelity, TreadFidelity
    from stairlab.results import StudyResults
    from stairlab.world import CubeWorld

DESCRIPTION = """\
Learn "Unsupervised Learning of Effective Actions in Robotics" by running it: a cube jumps at random before stairs (Algorithm 1), its
jumps are grouped by their effects (Algorithm 2), and each group gets a few action prototypes (equations 2 to 4)."""

EXAMPLES = {
    "run": "stairlab run --n 2000 --seed 0 --out out",
    "sample": "stairlab sample --n 2000 --seed 0 --output samples.csv",
    "prototypes": "stairlab prototypes samples.csv --preset paper-figures --output prototypes.csv",
    "replay": "stairlab replay prototypes.csv",
    "fidelity": "stairlab fidelity gazebo_jumps.csv --treads tread_jumps.csv",
    "published": "stairlab published beyond --out beyond",
    "study": "stairlab study --methods effect uniform random mine=motions.csv --seeds 0-19 --out study",
}
QUICK_NOTE = "this is a quick study: it shows the shape of a real one with small budgets, and its numbers say nothing about the paper"
SIDE_BY_SIDE = ("tumbling", "plane")
""" Worlds whose fidelity is shown where none is named """
MOST_SEEDS = 10_000
""" In one range of seeds """


class _Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: error: {message} (see {self.prog} --help)\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status: 0, 2 for a usage or input error, 130 on Ctrl-C."""
    options = build_parser().parse_args(arguments)
    warnings.showwarning = _show_warning
    try:
        options.command(options)
        sys.stdout.flush()
    except KeyboardInterrupt:
        print("\nstairlab: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:  # the reader, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (ValueError, TypeError, OSError, RuntimeError, MemoryError, ImportError) as error:
        print(f"stairlab {options.name}: error: {_one_line(error)}", file=sys.stderr)
        return 2
    return 0


def _one_line(error: Exception) -> str:
    if isinstance(error, MemoryError):
        return "there is not enough memory for so much at once"
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return " ".join(str(error).split())


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"stairlab: note: {message}", file=sys.stderr)


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the command and its subcommands."""
    parser = _Parser(prog="stairlab", description=DESCRIPTION)
    parser.add_argument("--version", action="version", version=_version())
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    run = _add(commands, "run", _run, "the whole pipeline: figures, tables and a report into a folder")
    _add_sampling(run)
    _add_world(run, "plane")
    run.add_argument("--out", type=Path, default=Path("out"), metavar="FOLDER", help="where to write (default: out)")

    sample = _add(commands, "sample", _sample, "perform random jumps and write them to a CSV file (Algorithm 1)")
    _add_sampling(sample)
    sample.add_argument("--output", type=Path, default=Path("samples.csv"), metavar="FILE", help="default: samples.csv")
    sample.add_argument(
        "--distribution",
        choices=("uniform", "gaussian", "grid"),
        default="uniform",
        help="of the motions (default: uniform)",
    )
    sample.add_argument(
        "--start",
        choices=("fixed", "drawn"),
        default="fixed",
        help="jump from the start pose, or from drawn ones (default: fixed)",
    )
    sample.add_argument("--integer-angles", action="store_true", help="round the angles, as in the published samples")
    sample.add_argument("--x-drift", action="store_true", help="in the plane, let x drift (Appendix C)")
    _add_world(sample, "plane")
    _add_steps(sample)

    prototypes = _add(commands, "prototypes", _prototypes, "samples in, effect classes, counts and prototypes out")
    prototypes.add_argument("samples", type=Path, metavar="SAMPLES", help="CSV file with the published columns")
    prototypes.add_argument(
        "--features", nargs="+", default=["dy", "dz"], metavar="NAME", help="effect dimensions (default: dy dz)"
    )
    prototypes.add_argument(
        "--preset",
        choices=("paper-figures", "paper-text", "released-code"),
        default="paper-figures",
        help="how k is chosen: silhouette over 3..6 (default), over 2..10, or Davies-Bouldin over 3..10 on scaled effects",
    )
    prototypes.add_argument(
        "--k-range", nargs=2, type=int, metavar=("LOW", "HIGH"), help="range of k instead of the preset's"
    )
    prototypes.add_argument(
        "--fixed", type=int, metavar="N", help="N prototypes a class instead of xi_k (the paper's method b: 5)"
    )
    prototypes.add_argument(
        "--single",
        choices=("mean", "nearest-effect"),
        default="mean",
        help="prototype of a class with xi_k = 1 (default: mean)",
    )
    prototypes.add_argument(
        "--refine",
        choices=("none", "nearest", "central", "agreeing", "core"),
        default="none",
        help="none is the paper; the others make effects more reliable without looking at a reward",
    )
    prototypes.add_argument("--output", type=Path, metavar="FILE", help="write the prototypes to this CSV file")
    _add_seed(prototypes)

    replay = _add(
        commands, "replay", _replay, "perform the motions of a file from the start pose and show their effects"
    )
    replay.add_argument(
        "motions", type=Path, metavar="MOTIONS", help="CSV file with the columns magnitude [N] and angle [degrees]"
    )
    replay.add_argument("--output", type=Path, metavar="FILE", help="write motions and effects to this CSV file")
    replay.add_argument("--x-drift", action="store_true", help="in the plane, let x drift (Appendix C)")
    _add_world(replay, "plane")
    _add_steps(replay)
    _add_seed(replay)

    published = _add(
        commands,
        "published",
        _published,
        "the study that comes with the package: tables, figures and a report into a folder",
    )
    published.add_argument(
        "part",
        nargs="?",
        default="tumbling",
        help="tumbling (three dimensions, the default), tumbling-as-published, tumbling-rocking-0.5, tumbling-rocking-2, "
        "tumbling-friction-0.8, tumbling-friction-1.2, plane, restitution-0, restitution-0.1 (the plane with other risers); beyond, "
        "tumbling-beyond (better sets and DQN settings)",
    )
    published.add_argument("--out", type=Path, metavar="FOLDER", help="where to write (default: published-PART)")

    fidelity = _add(
        commands,
        "fidelity",
        _fidelity,
        "measure how well the worlds agree with recorded jumps, from the start and from treads",
    )
    fidelity.add_argument(
        "recorded",
        type=Path,
        nargs="?",
        metavar="FILE",
        help="recorded jumps, to replay: CSV file with the published columns",
    )
    fidelity.add_argument(
        "--treads",
        type=Path,
        metavar="FILE",
        help="recorded rollouts on fifteen steps, to compare with rollouts of a world's own (columns rollout, jump, magnitude, angle, "
        "start_x to start_qw, end_x to end_qw)",
    )
    fidelity.add_argument(
        "--world",
        choices=("plane", "tumbling"),
        help="measure this one (default: both, side by side; with --json the figures of the world that is named, or else of the "
        "plane for FILE, also stand at the top)",
    )
    fidelity.add_argument(
        "--rollouts",
        type=int,
        default=2000,
        metavar="N",
        help="rollouts of a world's own with --treads (default: 2000)",
    )
    fidelity.add_argument(
        "--figure",
        type=Path,
        metavar="FILE",
        help="where to draw it (default: fidelity.png; with --json none); that of --treads, where both are given, beside it with "
        "_treads after its name",
    )
    _add_seed(fidelity)

    study = _add(commands, "study", _study, "train agents with different sets of motions, and compare them (figure 4)")
    _add_study(study)
    return parser


def _version() -> str:
    from stairlab import __version__

    return f"stairlab {__version__}"


def _add(commands: Any, name: str, command: Callable[[argparse.Namespace], None], text: str) -> argparse.ArgumentParser:
    parser = commands.add_parser(
        name,
        help=text,
        description=f"{text[0].upper()}{text[1:]}.",
        epilog=f"example: {EXAMPLES[name]}",
    )
    parser.set_defaults(command=command, name=name)
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    return parser


def _add_seed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seed", type=int, default=0, help="the same seed gives the same result (default: 0)")


def _add_sampling(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--n", type=int, default=2000, metavar="N", help="number of jumps (default: 2000)")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes, -1 for all cores (default: 1)")
    _add_seed(parser)


def _add_steps(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--steps", type=int, default=4, metavar="N", help="steps of the staircase (default: 4)")


def _add_world(parser: argparse.ArgumentParser, default: str) -> None:
    parser.add_argument(
        "--world",
        choices=("plane", "tumbling"),
        default=default,
        help=f"the plane, or three dimensions, where the cube turns and rolls (default: {default})",
    )


def _add_study(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--methods",
        nargs="+",
        metavar="NAME",
        help="effect, effect-reliable, fixed, uniform, random, uniform-matched, random-matched, sac (default: all of them); "
        "uniform-shifted, uniform-no-corners, effect-plus-steep, along-stairs (beyond the paper); or name=motions.csv for a set of "
        "your own",
    )
    parser.add_argument(
        "--seeds",
        nargs="+",
        type=_seeds,
        metavar="SEED",
        help="numbers and ranges, such as 0-4 7 (default: 0-5, with --quick 0-1)",
    )
    parser.add_argument(
        "--timesteps", type=int, metavar="N", help="jumps to train with (default: 30000, with --quick 2000)"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="where to write; what is there of the same study is not made again, and shown too (default: study, with --quick "
        "study-quick)",
    )
    parser.add_argument("--jobs", type=int, default=-1, metavar="N", help="processes, -1 for all cores (default: -1)")
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="of the scheduler of a Dask cluster, such as tcp://host:8786, to run on"
    )
    _add_world(parser, "tumbling")
    parser.add_argument(
        "--restitution",
        type=float,
        metavar="X",
        help="share of its speed that a riser of the plane gives back to the cube, 0 to 1 (default: as in the recorded jumps)",
    )
    parser.add_argument(
        "--rocking",
        type=float,
        default=1.0,
        metavar="X",
        help="how much the tumbling cube rocks before a jump (default: 1)",
    )
    parser.add_argument(
        "--friction", type=float, default=1.0, metavar="X", help="friction of the tumbling world (default: 1)"
    )
    parser.add_argument(
        "--as-published",
        action="store_true",
        help="the published code's readings: time-outs are terminations, 16-bit observations, one set for all seeds, the top goes on",
    )
    parser.add_argument(
        "--known",
        metavar="PART",
        help="a published study, or a folder of tables, whose runs are not made again (see: stairlab published)",
    )
    parser.add_argument(
        "--tuned",
        action="store_true",
        help="DQN settings that fit the task instead of the published ones, for all sets",
    )
    parser.add_argument(
        "--quick", action="store_true", help="small budgets, to see in minutes what comes out; the numbers say nothing"
    )


def _seeds(text: str) -> Sequence[int]:
    """Read a seed, or a range of them, such as 0-19."""
    if not (match := re.fullmatch(r"([0-9]{1,18})(?:-([0-9]{1,18}))?", text)):
        raise argparse.ArgumentTypeError(f"expected a seed from 0, or a range such as 0-19, not {text!r}")
    first = int(match[1])
    last = int(match[2] or first)
    if not first <= last < first + MOST_SEEDS:
        raise argparse.ArgumentTypeError(
            f"a range goes from a seed to a greater one, at most {MOST_SEEDS}, not {text!r}"
        )
    return range(first, last + 1)


def _world(options: argparse.Namespace) -> CubeWorld:
    from stairlab.physics import Staircase
    from stairlab.tumbling import stair_world

    return stair_world(options.world, Staircase(options.steps), x_drift=options.x_drift)


def _run(options: argparse.Namespace) -> None:
    from stairlab.pipeline import run_pipeline
    from stairlab.report import save_run

    _check_writable(options.out, folder=True)
    run = run_pipeline(n=options.n, seed=options.seed, n_jobs=options.jobs, world=options.world)
    save_run(run, options.out)
    _show({"summary": run.summary()}, options)
    _say(f"figures, tables and report in {options.out}: open {options.out / 'report.html'}")


def _sample(options: argparse.Namespace) -> None:
    from stairlab.sampling import sample_motions

    _check_writable(options.output)
    samples = sample_motions(
        _world(options),
        n=options.n,
        seed=options.seed,
        n_jobs=options.jobs,
        distribution=options.distribution,
        start=options.start,
        integer_angles=options.integer_angles,
    )
    samples.to_csv(options.output)
    effects = samples.to_frame()[["magnitude", "angle", "dx", "dy", "dz"]]
    table = effects.describe().loc[["mean", "std", "min", "50%", "max"]].rename_axis("of all jumps")
    _show({"jumps": len(samples), "on the map": int(samples.on_map.sum()), "samples": table}, options)
    _say(f"written to {options.output}")


def _prototypes(options: argparse.Namespace) -> None:
    from stairlab.effects import EffectClasses
    from stairlab.prototypes import effect_prototypes, prototype_counts
    from stairlab.sampling import Samples
    from stairlab.world import StairWorld

    if options.output:
        _check_writable(options.output)
    k_range = tuple(options.k_range) if options.k_range else None
    classes = EffectClasses.from_samples(
        Samples.from_csv(options.samples), options.features, options.preset, k_range=k_range, seed=options.seed
    )
    counts = prototype_counts(classes)
    prototypes = effect_prototypes(
        classes,
        options.seed,
        counts=None if options.fixed else counts,
        fixed=options.fixed,
        single=options.single,
        refine=options.refine,
        world=StairWorld(),
    )
    if options.output:
        prototypes.to_csv(options.output)
    tables = {
        "scores": classes.scores,
        "classes": classes.to_frame(),
        "counts": counts,
        "prototypes": prototypes.to_frame(),
    }
    _show(tables, options)
    if options.output:
        _say(f"prototypes written to {options.output}")


def _replay(options: argparse.Namespace) -> None:
    from stairlab._files import write_whole
    from stairlab.prototypes import Prototypes
    from stairlab.sampling import replay_motions

    if options.output:
        _check_writable(options.output)
    prototypes = Prototypes.from_csv(options.motions)
    samples = replay_motions(_world(options), prototypes.motions, options.seed, progress=True)
    effects = samples.to_frame()[["dx", "dy", "dz", "on_map"]].rename(columns={"on_map": "on map"})
    table = prototypes.to_frame().join(effects)
    if options.output:
        write_whole(options.output, lambda file: table.to_csv(file, index=False, lineterminator="\n"))
    _show({"effects": table}, options)
    if options.output:
        _say(f"written to {options.output}")


def _fidelity(options: argparse.Namespace) -> None:
    if not (options.recorded or options.treads):
        raise ValueError("name a FILE of recorded jumps, or one of recorded rollouts with --treads FILE, or both")
    figure = options.figure or (None if options.json else Path("fidelity.png"))
    if figure:
        _check_writable(figure)
    measured: dict[str, Mapping[str, Any]] = {}
    if options.recorded:
        measured["jumps"] = _start_fidelity(options)
    if options.treads:
        measured["treads"] = _tread_fidelity(options)
    if options.json:
        said = {name: _fidelity_json(by_world, options.world) for name, by_world in measured.items()}
        print(json.dumps(said["jumps"] | {"treads": said["treads"]} if len(said) > 1 else next(iter(said.values()))))
    for name, by_world in measured.items():
        if not options.json:
            _show_fidelity(name, by_world)
        if figure:
            beside = name == "treads" and options.recorded
            _draw_fidelity(name, by_world, figure.with_stem(f"{figure.stem}_treads") if beside else figure)


def _draw_fidelity(name: str, by_world: Mapping[str, Any], path: Path) -> None:
    from stairlab.drawing import save_figure
    from stairlab.plots import plot_fidelity, plot_tread_fidelity

    save_figure(plot_fidelity(by_world) if name == "jumps" else plot_tread_fidelity(by_world), path)
    _say(f"figure in {path}")


def _start_fidelity(options: argparse.Namespace) -> dict[str, Fidelity]:
    from stairlab.fidelity import measure_fidelity
    from stairlab.tumbling import stair_world

    names = [options.world] if options.world else SIDE_BY_SIDE
    return {name: measure_fidelity(options.recorded, stair_world(name), options.seed) for name in names}


def _tread_fidelity(options: argparse.Namespace) -> dict[str, TreadFidelity]:
    from stairlab.fidelity import measure_tread_fidelity
    from stairlab.physics import Staircase
    from stairlab.tumbling import stair_world

    worlds = [options.world] if options.world else SIDE_BY_SIDE
    return {
        name: measure_tread_fidelity(
            options.treads, stair_world(name, Staircase.fifteen()), options.rollouts, options.seed
        )
        for name in worlds
    }


def _fidelity_json(by_world: Mapping[str, Any], world: str | None) -> dict[str, Any]:
    """Return the figures of each world under its name; those of one stand at the top, too, where scripts have read them so far."""
    from stairlab.fidelity import Fidelity

    figures = {name: fidelity.summary() for name, fidelity in by_world.items()}
    some = next(iter(by_world.values()))
    if isinstance(some, Fidelity):
        return figures[world or "plane"] | figures
    references = [summary.pop("reference") for summary in figures.values()]  # the same for all
    return (figures[world] if world else {}) | {"reference": references[0]} | figures


def _show_fidelity(name: str, by_world: Mapping[str, Any]) -> None:
    from stairlab.fidelity import MOTION_RANGES, climb_table, fidelity_table, outcome_table, tread_fidelity_table

    some = next(iter(by_world.values()))
    if name == "jumps":
        print(f"{some.n} recorded jumps, replayed\n\n{fidelity_table(by_world).to_string()}")
        for world, fidelity in by_world.items():
            print(f"\n{world}: recorded (rows) against replayed (columns)\n{fidelity.confusion.to_string()}")
        print()
        return
    print(f"rollouts on fifteen steps\n\n{tread_fidelity_table(by_world).to_string()}")
    ranges = "; ".join(
        f"{name}: {low[0]:g} to {high[0]:g} N, {low[1]:g} to {high[1]:g} degrees"
        for name, (low, high) in MOTION_RANGES.items()
    )
    print(f"\nthe recorded jumps from treads, made again: shares that climb, fall, leave the map ({ranges})")
    print(outcome_table(by_world).to_string())
    for by in ("gap", "yaw"):
        print(
            f"\nshare of jumps of 350 to 650 N at 55 to 75 degrees that climb\n{climb_table(by_world, by).to_string()}"
        )


def _study(options: argparse.Namespace) -> None:
    from stairlab import Study, StudyResults  # from here a missing extra is named
    from stairlab.beyond import TUNED_DQN
    from stairlab.study_report import save_study

    out = options.out or Path("study-quick" if options.quick else "study")
    _check_writable(out, folder=True)
    if options.dask:
        from stairlab.cluster import dask_cluster
    given: dict[str, Any] = {"methods": options.methods, "seeds": options.seeds and list(chain(*options.seeds))}
    if options.timesteps is not None:
        given |= {"total_timesteps": options.timesteps, "eval_every": _eval_every(options)}
    if options.tuned:
        given["dqn"] = TUNED_DQN
    given = {name: value for name, value in given.items() if value is not None}
    given |= {name: getattr(options, name) for name in ("world", "restitution", "rocking", "friction", "as_published")}
    known = _known(options.known) if options.known else None
    study = (Study.quick if options.quick else Study)(out_dir=out, known=known, **given)
    with dask_cluster(options.dask) if options.dask else nullcontext():
        results = study.run(options.jobs)
    if any(out.glob("*/SHA256SUMS")):  # of earlier commands, too
        earlier = StudyResults.from_folder(out)
        results = known.joined(earlier) if known else earlier
    save_study(results, out)
    _show(({"note": QUICK_NOTE} if options.quick else {}) | {"summary": results.summary()}, options)
    _say(f"runs, tables, figures and report in {out}")


def _known(part: str) -> StudyResults:
    """Read the results that a study is to go on from: a published part, or a folder of tables."""
    from stairlab.results import StudyResults, load_published_study, published_studies

    return load_published_study(part) if part in published_studies() else StudyResults.load(part)


def _published(options: argparse.Namespace) -> None:
    from stairlab.results import load_published_study
    from stairlab.study_report import save_study

    results = load_published_study(options.part)
    out = options.out or Path(f"published-{options.part}")
    _check_writable(out, folder=True)
    save_study(results, out)
    _show({"command": results.command(), "summary": results.summary()}, options)
    _say(f"tables, figures and report in {out}: open {out / 'report.html'}")


def _eval_every(options: argparse.Namespace) -> int:
    """Evaluate as often as usual, and a short training at its end."""
    from stairlab.study import EVAL_EVERY, QUICK

    return min(QUICK["eval_every"] if options.quick else EVAL_EVERY, max(options.timesteps, 1))


def _check_writable(path: Path, folder: bool = False) -> None:
    """Refuse an output that cannot be written before any work is done."""
    place = path if folder else path.parent
    while folder and not place.exists():  # it will be made
        place = place.parent
    if folder and not place.is_dir():
        raise ValueError(f"{place} is a file; name a folder")
    if not place.is_dir():
        raise ValueError(f"the folder {place} must exist to write {path.name} into it")
    if not os.access(place, os.W_OK):
        raise ValueError(f"the folder {place} must be writable")
    if not folder and path.is_dir():
        raise ValueError(f"{path} is a folder; name a file")


def _show(tables: Mapping[str, pd.DataFrame | int | str], options: argparse.Namespace) -> None:
    if options.json:
        print(
            json.dumps(
                {name: value if isinstance(value, int | str) else _records(value) for name, value in tables.items()}
            )
        )
        return
    for name, value in tables.items():
        if isinstance(value, int | str):
            print(f"{name}: {value}")
        elif len(value):
            print(f"\n{name}\n{value.to_string(float_format=_short, index=value.index.name is not None)}")


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows as JSON objects; NaN and infinity, which JSON does not know, become null."""
    named = table.reset_index() if table.index.name else table
    return [
        {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
        for row in named.to_dict("records")
    ]


def _short(value: float) -> str:
    return f"{value:.3f}" if abs(value) < 100 else f"{value:.1f}"


def _say(text: str) -> None:
    print(text, file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
