"""Machine code on disk belongs to the sources that it was made of, in whichever file they stand."""

from __future__ import annotations

from pathlib import Path

from data_synthetic import _compile
from data_synthetic.scanner import coverage

PACKAGE = Path(_compile.__file__).parent


def test_every_compiled_function_is_kept_by_the_one_mechanism() -> None:
    users = [p.name for p in PACKAGE.rglob("*.py") if "njit" in p.read_text(encoding="utf-8")]
    assert users == ["_compile.py"]


def test_a_caller_depends_on_the_files_of_what_it_calls() -> None:
    behind = {str(p.relative_to(PACKAGE)) for p in _compile.sources_of(Path(coverage.__file__))}
    assert {"scanner/coverage.py", "anatomy/_kernels.py", "geometry.py"} <= behind
