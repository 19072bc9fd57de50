"""Machine code kept on disk goes when a source behind it changes, in every package that has kernels."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from numba.core.caching import IndexDataCacheFile

from solver._compile import sources_of

ROOT = Path(__file__).resolve().parent.parent
COPIES = ("solver", "data_synthetic")
ONE = COPIES[:1]
"""The other is the same text."""


def test_the_two_copies_of_the_mechanism_are_one_text() -> None:
    first, second = ((ROOT / package / "_compile.py").read_text(encoding="utf-8") for package in COPIES)
    assert first == second


@pytest.mark.parametrize("package", ["solver", "pipeline", "data_synthetic", "reports"])
def test_nothing_is_cached_past_the_mechanism(package: str) -> None:
    """numba's own ``cache=True`` looks at a function's own file alone."""
    files = [p for p in (ROOT / package).rglob("*.py") if p.name != "_compile.py"]
    wrong = [str(p) for p in files if re.search(r"cache\s*=\s*True", p.read_text(encoding="utf-8"))]
    assert not wrong, "use on_disk of _compile"


def package_in(tmp_path: Path, package: str) -> Path:
    """A package of this name that holds the mechanism alone."""
    folder = tmp_path / package
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "_compile.py").write_text((ROOT / package / "_compile.py").read_text(encoding="utf-8"))
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("package", ONE)
def test_an_edited_callee_is_compiled_again(package: str, tmp_path: Path) -> None:
    """The callee stands two files away, and its new text has the length and the time of the old one."""
    folder = package_in(tmp_path, package)
    head = f"from {package}._compile import on_disk\n"
    kernel = head + "{imports}\n\n@on_disk()\ndef {name}():\n    return {value}\n"
    (folder / "callee.py").write_text(kernel.format(imports="", name="callee", value=1), encoding="utf-8")
    middle = kernel.format(imports=f"from {package}.callee import callee", name="middle", value="callee()")
    (folder / "middle.py").write_text(middle, encoding="utf-8")
    caller = kernel.format(
        imports=f"from {package} import middle as m\nmiddle = m.middle", name="caller", value="middle()"
    )
    (folder / "caller.py").write_text(caller, encoding="utf-8")
    assert [called(tmp_path, package) for _ in range(2)] == ["1", "1"]
    path, state = folder / "callee.py", (folder / "callee.py").stat()
    path.write_text(kernel.format(imports="", name="callee", value=2), encoding="utf-8")
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
    assert called(tmp_path, package) == "2"


@pytest.mark.slow
@pytest.mark.parametrize("package", ONE)
def test_code_without_docstrings_is_kept_beside_that_with_them(package: str, tmp_path: Path) -> None:
    """PYTHONOPTIMIZE=2 and a plain run took each other's files, so that each compiled all anew."""
    folder = package_in(tmp_path, package)
    text = f'from {package}._compile import on_disk\n\n@on_disk()\ndef caller():\n    "Why."\n    return 1\n'
    (folder / "caller.py").write_text(text, encoding="utf-8")
    for options in ((), ("-OO",)):
        called(tmp_path, package, *options)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*.nbc")}
    assert len(before) == 2
    called(tmp_path, package)
    assert {path: path.stat().st_mtime_ns for path in before} == before


@pytest.mark.parametrize("package", ONE)
def test_two_processes_that_compile_at_one_time_do_not_mix_their_code(package: str, tmp_path: Path) -> None:
    """Both took the number 1, and one's types were answered with the other's code ever after: a segmentation fault."""
    kept = import_module(f"{package}._compile")._ByTypes
    numbered = IndexDataCacheFile(str(tmp_path), "function", "stamp")
    one, two = (kept(numbered, "stamp") for _ in range(2))
    first, second = ((types, ("cpu",), ("code", "")) for types in ("float32", "int16"))
    save, two._load_index = one._save_data, dict

    def meanwhile(*args: object) -> None:
        two.save(second, "code for int16")
        save(*args)

    one._save_data = meanwhile
    one.save(first, "code for float32")
    third = kept(numbered, "stamp")
    assert third.load(first) == "code for float32"
    assert third.load(second) in (None, "code for int16")
    name = third._load_index()[first]
    third._save_data(name, (("stamp", second), "code for int16"))
    assert third.load(first) is None, "of another key, whatever its name"
    third.save(first, "code for float32")
    kept(numbered, "stamp of earlier sources")._save_data(name, (("stamp of earlier sources", first), "old code"))
    assert third.load(first) is None, "of a process that began before an edit"


@pytest.mark.slow
@pytest.mark.parametrize("package", ONE)
def test_a_part_of_callers_runs_in_them_alone(package: str, tmp_path: Path) -> None:
    """Compiled here or read from the disk it computes, raises with its message, and is refused to Python."""
    folder = package_in(tmp_path, package)
    head = f"from {package}._compile import on_disk, part_of_callers\n\n"
    text = head + (
        "@part_of_callers()\ndef root(x):\n    if x < 0:\n        raise ValueError('of', x)\n    return x**0.5\n\n"
        "@part_of_callers(how=on_disk)\ndef kept(x):\n    return root(x) + 1.0\n\n"
        "@on_disk()\ndef entry(x):\n    return kept(x)\n\n"
        "def caller():\n    said = [entry(4.0)]\n    for function in (entry, root, kept):\n"
        "        try:\n            function(-4.0)\n        except Exception as error:\n"
        "            said.append((type(error).__name__, error.args[-1]))\n    return said\n"
    )
    (folder / "caller.py").write_text(text, encoding="utf-8")
    refused = [
        ("TypeError", f"{name} is for compiled code: call an entry point, or write one in a test")
        for name in ("root", "kept")
    ]
    expected = str([3.0, ("ValueError", -4.0), *refused])
    assert [called(tmp_path, package) for _ in range(2)] == [expected, expected]


def called(folder: Path, package: str, *options: str) -> str:
    code = f"from {package}.caller import caller; print(caller())"
    done = subprocess.run(
        [sys.executable, "-B", *options, "-c", code], cwd=folder, capture_output=True, encoding="utf-8", check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_sources_are_followed_through_imports_of_every_form(tmp_path: Path) -> None:
    folder = tmp_path / "solver"
    folder.mkdir()
    texts = {
        "__init__": "from solver.unrelated import x",
        "start": "from solver import one as first, two\nimport solver.three\nfrom solver.four import (\n    name,\n)\n"
        "def late():\n    from solver.five import z",
        **dict.fromkeys(("one", "two", "three", "five", "six", "unrelated"), ""),
        "four": "from solver import six",
    }
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    found = {path.stem for path in sources_of(folder / "start.py")}
    assert found == {"start", "one", "two", "three", "four", "five", "six"}
