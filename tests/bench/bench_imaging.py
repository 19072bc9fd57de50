"""All figures of segment and trace in one command: python -m tests.bench.bench_imaging [--quick] [--only NAME].

Seeds from 100 on (tracing 300-307, topology 400-599), none of which was used while tuning: 0-9 were, and 0-40 of the
tangles.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from tests.bench.imaging import connect, real, speed, topology, tracing, wall

PARTS = {"connect": connect, "wall": wall, "tracing": tracing, "topology": topology, "speed": speed, "real": real}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="smaller volumes and fewer seeds, about two minutes")
    parser.add_argument("--only", choices=PARTS, action="append", help="one table alone; may be repeated")
    parser.add_argument("--picture", type=Path, help="where the picture of the real aneurysm tree goes (.png)")
    options = parser.parse_args()
    for name in options.only or PARTS:
        start = time.perf_counter()
        extra = {"picture": options.picture} if name == "real" else {}
        PARTS[name].report(options.quick, **extra)
        print(f"   ({name}: {time.perf_counter() - start:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
