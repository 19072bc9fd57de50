"""What is handed out beside the checkout: the wheel, in an environment with nothing else, and the manual as a site."""

import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).resolve().parents[1]
UNREACHABLE = "No matching distribution found", "Could not find a version"
"""What pip says where no index answers."""


OF_THE_CHECKOUT = "data_synthetic/CATALOGUE.md", "reports/baseline/catalogue/", "reports/pictures/"
"""What is looked at in the checkout alone."""
PACKAGES = "data_synthetic", "pipeline", "reports", "solver"


def run(words: list[str], what: str) -> str:
    """The output of a command; skips the test where it would install packages and cannot."""
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=600, cwd=ROOT)
    if any(words in done.stderr for words in UNREACHABLE):
        pytest.skip(f"{what} installs packages, and no index can be reached")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.mark.slow
def test_the_wheel_holds_what_the_checkout_has(tmp_path: Path) -> None:
    """That it runs, too, is shown by ``make package``, a minute."""
    if not (ROOT / ".git").exists():
        pytest.skip("no git repository, which tells what belongs to the checkout")
    source = tmp_path / "source"
    run(["git", "clone", "--quiet", "--depth", "1", f"file://{ROOT}", str(source)], "git")
    run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(tmp_path), str(source)], "pip wheel")
    (wheel,) = tmp_path.glob("*.whl")
    held = {name for name in ZipFile(wheel).namelist() if ".dist-info/" not in name}
    files = run(["git", "-C", str(source), "ls-files", *PACKAGES], "git").split()
    # the package wireval lies below pipeline in the checkout
    wanted = {name.removeprefix("pipeline/") if name.startswith("pipeline/wireval/") else name for name in files}
    assert held - wanted == set()
    assert {name for name in wanted - held if not name.startswith(OF_THE_CHECKOUT)} == set()


@pytest.mark.slow
@pytest.mark.parametrize("target", ["package", "docs"])
def test_is_made_from_a_checkout(target: str, tmp_path: Path) -> None:
    # mkdocs takes a broken link for an error; the wheel is installed outside the checkout, run, and type-checked
    if not (ROOT / ".venv/.ready").exists():
        pytest.skip("make setup has not been run in this checkout: its targets would build an environment first")
    run(["make", "-C", str(ROOT), target, f"OUT={tmp_path}"], f"make {target}")
