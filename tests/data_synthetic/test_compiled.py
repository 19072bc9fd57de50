"""Machine code on disk belongs to the sources that it was made of, in whichever file they stand."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from data_synthetic import _compile
from data_synthetic.scanner import phantom

PACKAGE = Path(_compile.__file__).parent


def test_every_compiled_function_is_kept_by_the_one_mechanism() -> None:
    users = [p.name for p in PACKAGE.rglob("*.py") if "njit" in p.read_text(encoding="utf-8")]
    assert users == ["_compile.py"]


def test_the_two_copies_of_the_mechanism_are_one() -> None:
    assert (PACKAGE.parent / "solver" / "_compile.py").read_bytes() == Path(_compile.__file__).read_bytes()


def test_a_caller_depends_on_the_files_of_what_it_calls() -> None:
    behind = {str(p.relative_to(PACKAGE)) for p in _compile.sources_of(Path(phantom.__file__))}
    assert {"scanner/phantom.py", "anatomy/_kernels.py", "geometry.py"} <= behind


def test_an_edit_behind_a_caller_is_run(tmp_path: Path) -> None:
    """numba alone looks at the caller's own file and would go on saying 2."""
    package = tmp_path / "data_synthetic"
    package.mkdir()
    (package / "__init__.py").touch()
    shutil.copy(_compile.__file__, package)
    kernel = "from data_synthetic._compile import on_disk\n{0}\n@on_disk()\ndef {1}():\n    return {2}\n"
    (package / "caller.py").write_text(kernel.format("from data_synthetic.called import called", "caller", "called()"))
    said = []
    for number in (2, 2, 3):
        (package / "called.py").write_text(kernel.format("", "called", number))
        words = [sys.executable, "-c", "from data_synthetic.caller import caller; print(caller())"]
        done = subprocess.run(words, capture_output=True, encoding="utf-8", check=True, cwd=tmp_path)
        said.append(int(done.stdout))
    assert said == [2, 2, 3]
