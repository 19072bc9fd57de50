"""What is handed out beside the checkout: the wheel, in an environment with nothing else, and the manual as a site."""

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
UNREACHABLE = "No matching distribution found", "Could not find a version"
"""What pip says where no index answers."""


@pytest.mark.parametrize("target", ["package", pytest.param("docs", marks=pytest.mark.slow)])
def test_is_made_from_a_checkout(target: str, tmp_path: Path) -> None:
    # mkdocs takes a broken link for an error; the wheel is installed outside the checkout, run, and type-checked
    if not (ROOT / ".venv/.ready").exists():
        pytest.skip("make setup has not been run in this checkout: its targets would build an environment first")
    words = ["make", "-C", str(ROOT), target, f"OUT={tmp_path}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=600)
    if any(words in done.stderr for words in UNREACHABLE):
        pytest.skip(f"make {target} installs packages, and no index can be reached")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
