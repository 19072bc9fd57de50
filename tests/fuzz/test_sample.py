"""A sample of `make fuzz` for every commit."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def test_malformed_inputs_end_well(tmp_path: Path) -> None:
    """What once ended badly, and every 160th of those that are written out; in a process that forks one for each."""
    command = [sys.executable, "-W", "ignore", "-m", "tests.fuzz", "--count", "0", "--every", "160", "--examples"]
    place = {"TMPDIR": str(tmp_path), "WIREVAL_CACHE": str(tmp_path / "stages")}
    done = subprocess.run(command, capture_output=True, encoding="utf-8", env=os.environ | place, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
