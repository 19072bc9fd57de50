"""``wireval synth NAME -o DIR``: a study with truth, written as real files."""

import sys
from argparse import ArgumentParser, Namespace
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from pipeline.commands import add_quiet, say
from pipeline.status import UsageError, did_you_mean
from reports.atomic import WriteError
from reports.texts import size_of, status_of

HELP = "write a synthetic study with truth, as real files"
MOST_FRICTION, MOST_INSERTIONS = 1.0, 1000


def add_arguments(parser: ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    add("name", nargs="?", metavar="NAME", help="a scene of the catalogue; --list names them")
    add("-o", "--out", type=Path, metavar="DIR", help="folder for the study")
    add("--list", action="store_true", help="name the scenes, each with its reason")
    add("--anatomy", type=Path, metavar="FILE", help="vessel tree, .swc or .mrk.json with radii; smoothed if jagged")
    add(
        "--background",
        type=Path,
        metavar="VOLUME",
        help="a real scan to paint a wire into (and a vessel, if it has none)",
    )
    add("--format", default="mha", choices=("mha", "nrrd", "nii.gz", "dicom", "h5"), help="of the scans (default mha)")
    add("--frames", type=int, metavar="N", help="scans with the wire; each scene has its own number")
    add(
        "--insertions",
        type=int,
        default=1,
        metavar="N",
        help="into the same phantom, each rolled anew, in one manifest",
    )
    add("-j", "--jobs", type=int, default=1, metavar="N", help="insertions made at once (default 1)")
    add("--size", type=int, metavar="N", help="voxels along each axis; each scene has a least number, which is told")
    add("--voxel-mm", type=float, metavar="V", help="size of a voxel")
    add("--seed", type=int, default=0, metavar="S", help="of what is drawn at random (default 0)")
    add("--friction", type=float, metavar="F", help="Coulomb's coefficient of the true wire and the wall")
    add(
        "--scanner", default="psf", choices=("psf", "conebeam"), help="ideal, or 3D rotational X-ray (extra [conebeam])"
    )
    add(
        "--fresh",
        action="store_true",
        help="overwrite a manifest that was changed since, and files that are in no study of synth",
    )
    add_quiet(parser)


if TYPE_CHECKING:
    from collections.abc import Iterator

    from data_synthetic.catalogue import Wanted
    from data_synthetic.catalogue.scene import NamedScene


@contextmanager
def _written(folder: Path) -> "Iterator[None]":
    """What the system says about a study that it cannot write becomes a WriteError, which names the file."""
    try:
        yield
    except OSError as error:
        what = f"{error.filename or folder}: cannot be written: {error.strerror or error}"
        raise WriteError(f"{what}; make room or allow writing there, then give the same command again") from error


def _progress(done: int, total: int) -> None:
    """One line per written frame, on stderr, so that stdout holds the result alone."""
    end = "\r" if sys.stderr.isatty() and done < total else "\n"
    sys.stderr.write(f"frame {done}/{total}{end}")
    sys.stderr.flush()


def _problems(args: Namespace) -> list[str]:
    """What is wrong with the command line before any file is read; empty where nothing is."""
    from data_synthetic import catalogue

    sources = [s for s in (args.name, args.anatomy, args.background) if s is not None]
    if len(sources) != 1:
        return ["give one of NAME (--list shows them), --anatomy FILE and --background VOLUME"]
    if args.name is not None and args.name not in catalogue.names():
        return [f"no scene {args.name!r}; {did_you_mean(args.name, catalogue.names())}"]
    if not 1 <= args.insertions <= MOST_INSERTIONS:
        return [f"--insertions: expected 1 to {MOST_INSERTIONS}"]
    if args.name is None and args.scanner != "psf":
        return [f"--scanner {args.scanner}: only the catalogue's scenes can be scanned so; leave it out"]
    if args.friction is not None and not 0.0 <= args.friction <= MOST_FRICTION:
        return [f"--friction {args.friction:g}: expected 0 to {MOST_FRICTION:g}; hydrophilic wires have 0.01 to 0.1"]
    for path in (args.anatomy, args.background):
        if path is not None and status_of(path) is None:
            return [f"{path}: no such file"]
        if path is not None and not (path == args.background and path.is_dir()):  # of DICOM slices
            size_of(path)
    return [] if args.out is not None else ["-o DIR is missing: where shall the study be written?"]


def _scene(args: Namespace) -> "NamedScene":
    """The scene that is asked for; ValueError where its file holds none."""
    from data_synthetic import catalogue

    if args.background is not None:
        scene = catalogue.background_scene(args.background, args.voxel_mm)
    else:
        scene = catalogue.from_anatomy(args.anatomy) if args.name is None else catalogue.describe(args.name)
    return scene if args.friction is None else scene.with_friction(args.friction)


def _thick(scene: "NamedScene") -> str:
    """What is to be said of a real scan whose slices lie too far apart for any trace; empty elsewhere."""
    from pipeline.trace.config import MOST_APART

    spacing = [float(mm) for mm in scene.scan[0].spacing_mm] if scene.scan else [1.0]
    apart = max(spacing) / min(spacing)
    told = f"; its slices are {apart:.1f} times as thick as its pixels: no trace is accepted there"
    return told if apart >= MOST_APART else ""


def main(args: Namespace) -> int:
    """Exit 0 when the study is written, 2 on wrong input."""
    from data_synthetic import catalogue

    if args.list:
        for name in catalogue.names():
            say(f"{name:24s} {catalogue.describe(name).why}")
        return 0
    problems = _problems(args)
    if problems:
        raise UsageError(problems)
    try:
        return _one(args) if args.insertions == 1 else _several(args)
    except MemoryError:
        raise UsageError(["the scans do not fit into memory; give a smaller --size"]) from None


def _one(args: Namespace) -> int:
    """One study; as ``main``."""
    from data_synthetic import catalogue
    from data_synthetic.write import earlier_files, edited, in_the_way, write_study

    clock = perf_counter()
    chat = (lambda _: None) if args.quiet else say
    numbers = {"frames": args.frames, "size": args.size, "voxel_mm": args.voxel_mm, "seed": args.seed}
    try:
        scene = _scene(args)
        problems = catalogue.Wanted(**numbers).problems(scene, args.scanner)
        problems = problems or in_the_way(args.out, args.format, args.frames or scene.frames, fresh=args.fresh)
        problems = problems or edited(args.out) * (not args.fresh)
        if problems:
            raise UsageError(problems)
        if args.background is not None:
            say(f"{scene.name}: {scene.why}{_thick(scene)}")
        chat("the true wire is computed: seconds to minutes")
        study = catalogue.build(scene, scanner=args.scanner, **numbers)
    except (ValueError, ImportError) as error:
        raise UsageError([str(error)]) from None
    quality = study.quality
    chat(
        f"truth: largest force residual {quality['largest_residual_N']:.1e} N; halving its resolution moves it by "
        f"{quality['halving_moves_mm']:.4f} mm"
    )
    earlier = len(earlier_files(args.out))
    if earlier:
        chat(f"{args.out}: an earlier study is replaced: its {earlier} files are removed")
    with _written(args.out):
        shown = None if args.quiet else _progress
        manifest = write_study(study, args.out, args.format, shown, fresh=args.fresh)
    say(f"{study.name}: written in {perf_counter() - clock:.0f} s.  manifest: {manifest}")
    return 0


def _several(args: Namespace) -> int:
    """Several insertions into one phantom, shared out among processes; as ``main``."""
    from data_synthetic.write import alone, edited, in_the_way, write_all_of_them
    from pipeline.run.helpers import shared

    clock = perf_counter()
    try:
        scene = _scene(args)
        frames = args.frames or scene.frames
        problems = _wanted(args).problems(scene, args.scanner) + (
            alone(args.out) or edited(args.out) * (not args.fresh)
        )
        folders = [] if problems else [args.out / str(n + 1) for n in range(args.insertions)]
        problems += [text for folder in folders for text in in_the_way(folder, args.format, frames, fresh=args.fresh)]
    except ValueError as error:
        problems = [str(error)]
    if problems:
        raise UsageError(problems)
    shares = [range(first, args.insertions, args.jobs) for first in range(min(args.jobs, args.insertions))]
    done = shared(lambda number, _: _share(args, shares[number]), len(shares), len(shares))
    parts = {number: text for part in done for number, text in part.items()}
    manifest = write_all_of_them([parts[number] for number in sorted(parts)], args.out)
    say(f"{scene.name}: {len(parts)} insertions written in {perf_counter() - clock:.0f} s.  manifest: {manifest}")
    return 0


def _wanted(args: Namespace) -> "Wanted":
    from data_synthetic.catalogue import Wanted

    return Wanted(args.frames, args.size, args.voxel_mm, args.seed)


def _share(args: Namespace, numbers: range) -> dict[int, str]:
    """A process's share of the insertions, written; their parts of the manifest."""
    from data_synthetic import catalogue
    from data_synthetic.write import write_one_of

    plan, written = catalogue.prepare(_scene(args), catalogue.SCANNERS[args.scanner], _wanted(args)), {}
    for number in numbers:
        with _written(args.out / str(number + 1)):
            study = catalogue.insertion_into(plan, number)
            written[number] = write_one_of(study, args.out, number + 1, args.format, fresh=args.fresh)
        if not args.quiet:
            sys.stderr.write(f"insertion {number + 1}/{args.insertions}\n")
    return written
