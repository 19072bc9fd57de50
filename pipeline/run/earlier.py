"""What earlier runs have left in an output folder and a new one removes: records, and cases of other manifests."""

import sys
from contextlib import suppress
from glob import escape
from pathlib import Path

from pipeline.run import ledger
from pipeline.run.case import clear
from reports.atomic import remove_files
from reports.case_files import left_over
from reports.records import read_json, run_records


def remove_arrays(out: Path, name: str) -> None:
    """Remove what shards of arrays of another size say of themselves: their cases are computed anew, or kept, by this.

    A line on stderr says so: who mistyped one number of an array would look for the cases of the other. name : of this
    run's record.
    """
    size = name.rpartition("-")[2]
    others = [path for path in run_records(out) if "-" in path.name and not path.name.endswith(f"-{size}")]
    if "-" not in name or not others:
        return
    remove_files(*others)
    sizes = " and of ".join(map(str, sorted({int(path.stem.rpartition("-")[2]) for path in others})))
    count = int(Path(name).stem.rpartition("-")[2])
    sys.stderr.write(
        f"{out}: shards of an array of {sizes} wrote here, and this is one of {count}: their records were removed; run "
        f"all {count}, which keep the cases that are finished\n"
    )


def remove_records(out: Path, manifest: str) -> None:
    """Remove what runs of other manifests say of themselves: shards, once all cases of another one were run.

    And what is damaged, which would keep pages from being drawn.
    """
    for path in run_records(out):
        whose = ""
        with suppress(ValueError):
            whose = read_json(path).get("manifest_sha256", "")
        if whose != manifest:
            remove_files(path)


def _of_a_run(folder: Path) -> bool:
    """Whether a run wrote the result in a case's folder: one of a crashed case has no ledger, and names the case."""
    with suppress(ValueError):
        return (folder / ledger.FILE).exists() or read_json(folder / ledger.RESULT).get("case") == folder.name
    return False


def remove_others(out: Path, manifest: str) -> None:
    """Remove what runs of other manifests have left in an output folder: their records, and cases that they alone had.

    manifest : SHA-256 of the manifest whose runs stay.
    """
    remove_records(out, manifest)
    for folder in filter(_of_a_run, left_over(out)):
        for place in (folder, *out.glob(f"sweep/*/cases/{escape(folder.name)}")):
            clear(place)
            remove_files(place / "log.txt")
            with suppress(OSError):  # something of the user's own lies in it
                place.rmdir()
