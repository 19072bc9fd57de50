"""Print the table of the format study: ``python -m tests.studies.formats``."""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.studies.formats import outcome, variants


def main() -> int:
    """Print the table; exit 1 where a variant is wrong."""
    table: Counter[tuple[str, str]] = Counter()
    for variant in variants():
        with tempfile.TemporaryDirectory() as folder:
            found = outcome(variant, Path(folder))
        if found.startswith("wrong"):
            print(f"{variant.name}: {found}")
        table[variant.name.split(",")[0], found.split(":")[0]] += 1
    columns = ("right", "noted", "refused", "wrong")
    print(f"{'format':28s}" + "".join(f"{c:>10s}" for c in columns))
    for kind in dict.fromkeys(kind for kind, _ in table):
        print(f"{kind:28s}" + "".join(f"{table[kind, c]:10d}" for c in columns))
    totals = [sum(n for (_, c), n in table.items() if c == column) for column in columns]
    print(f"{'all ' + str(sum(totals)):28s}" + "".join(f"{n:10d}" for n in totals))
    return int(totals[-1] > 0)


if __name__ == "__main__":
    sys.exit(main())
