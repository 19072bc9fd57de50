"""What README and docs/ say is true: their blocks run as typed, in one folder, page after page; links lead somewhere;
reference pages are what the code says."""

from __future__ import annotations

import ast
import contextlib
import io
import json
import re
import shlex
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from pipeline.cli import main
from pipeline.load.views import read_views
from pipeline.study.manifest import ManifestTables
from tests.studies import reference_pages
from tests.unseen import unseen_figures as unseen_figures

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
BLOCK = re.compile(r"(?:<!-- not run: (?P<why>[^\n]+) -->\n)?^```(?P<kind>\w*)[^\n]*\n(?P<text>.*?)^```$", re.M | re.S)
QUICK = [DOCS / "tutorial.md", ROOT / "README.md", *(p for p in PAGES[1:] if p.name != "tutorial.md")]
"""The tutorial first: it makes the study and the output that the others speak of."""


QUICKSTART = "wireval synth straight -o study", "wireval run study -o out"


def label(path: Path) -> str:
    return str(path.relative_to(ROOT))


def blocks(path: Path, *kinds: str) -> list[str]:
    found = BLOCK.finditer(path.read_text(encoding="utf-8"))
    return [block["text"] for block in found if block["kind"] in kinds and not block["why"]]


@pytest.fixture(scope="module")
def done() -> set[tuple[str, ...]]:
    """The commands that were typed so far."""
    return set()


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory, done: set[tuple[str, ...]]) -> Path:
    """The folder in which a reader types all that, after the quickstart, in whatever order pages are read."""
    folder = tmp_path_factory.mktemp("desk")
    with contextlib.chdir(folder):
        for line in QUICKSTART:
            typed(line, done)
    return folder


def typed(line: str, done: set[tuple[str, ...]]) -> None:
    words = shlex.split(line, comments=True)
    # a study that a page before made is not made again
    if words and not (tuple(words) in done and words[1] == "synth"):
        done.add(tuple(words))
        assert words[0] == "wireval", f"{line}: only wireval is run; say <!-- not run: why --> above the block"
        assert main(words[1:]) == 0, line


SLOW = {"calibrate.md"}
"""Half a minute: what it shows is tested by itself."""


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=[pytest.mark.slow] * (p.name in SLOW), id=label(p)) for p in QUICK]
)
def test_blocks_run_as_typed(
    page: Path, desk: Path, done: set[tuple[str, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(desk)
    names: dict[str, Any] = {}
    for block in BLOCK.finditer(page.read_text(encoding="utf-8")):
        if block["why"]:
            continue
        if block["kind"] == "":
            for line in block["text"].splitlines():
                typed(line, done)
        elif block["kind"] == "python":
            exec(compile(block["text"], label(page), "exec"), names)
        else:
            assert block["kind"] in ("toml", "yaml", "text", "json"), "what is neither run nor said not to be"


def told(text: str, name: str, names: dict[str, Any]) -> str:
    """What a cell of a notebook prints and what its last line is."""
    *before, last = ast.parse(text).body
    with contextlib.redirect_stdout(io.StringIO()) as said:
        exec(compile(ast.Module(before, []), name, "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), name, "eval"), names)
            return said.getvalue() + (repr(value) if value is not None else "")
        exec(compile(ast.Module([last], []), name, "exec"), names)
    return said.getvalue()


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]


@pytest.mark.parametrize("path", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=label)
def test_notebooks_are_executed_and_still_show_that(path: Path, desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The text of a cell had told the skill of an earlier version."""
    monkeypatch.chdir(desk)
    monkeypatch.setenv("MPLBACKEND", "agg")
    cells = [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    names: dict[str, Any] = {}
    for number, cell in enumerate(cells, 1):
        assert cell["execution_count"] == number
        assert cell["outputs"], "a cell that shows nothing"
        text = told("".join(line for line in cell["source"] if not line.startswith("%")), label(path), names)
        kept = [out.get("text") or out["data"]["text/plain"] for out in cell["outputs"]]
        shown = "".join("".join(one) for one in kept if "<Figure" not in "".join(one))
        assert numbers(text) == pytest.approx(numbers(shown), abs=2e-4)
    assert not re.search(r"/(?:work|tmp|root|home)/", path.read_text(encoding="utf-8")), "a machine's path"


def test_the_blocks_are_found() -> None:
    assert len(blocks(ROOT / "README.md", "")) == 1
    assert len(blocks(ROOT / "README.md", "python", "toml")) == 2
    assert BLOCK.search("<!-- not run: x -->\n```\nmake\n```")["why"] == "x"  # type: ignore[index]


@pytest.mark.parametrize("page", PAGES, ids=label)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), f"{label(page)}: {target}"
        if anchor:
            heads = re.findall(r"^#+ (.+)$", there.read_text(encoding="utf-8"), re.M)
            slugs = [re.sub(r"[^\w\- ]", "", head).strip().lower().replace(" ", "-") for head in heads]
            assert anchor in slugs, f"{label(page)}: {target}; {slugs}"


@pytest.mark.parametrize("name", reference_pages.PAGES)
def test_reference_is_what_the_code_says(name: str) -> None:
    assert (DOCS / name).read_text(encoding="utf-8") == reference_pages.PAGES[name](), "run: make pages"


def test_manifests_of_the_manual_fit_the_schema_and_the_code(tmp_path: Path) -> None:
    made = reference_pages.manifest_schema()
    texts = [text for page in PAGES for text in blocks(page, "toml") if "[[case]]" in text]
    assert texts
    for name in ("f0.mha", "f1.mha"):
        (tmp_path / "frames").mkdir(exist_ok=True)
        (tmp_path / "frames" / name).touch()
    for text in texts:
        jsonschema.validate(tomllib.loads(text), made)
        ManifestTables.model_validate(tomllib.loads(text), context={"folder": tmp_path})


def _jobs_of_ci() -> list[dict[str, Any]]:
    """The job of each file for a build server."""
    yaml = pytest.importorskip("yaml")  # comes with the extra docs
    github, gitlab = (yaml.safe_load(text) for text in blocks(DOCS / "howto" / "ci.md", "yaml"))
    return [github["jobs"]["gate"], gitlab["gate"]]


def test_files_for_build_servers_are_yaml_and_keep_compiled_code() -> None:
    github, gitlab = _jobs_of_ci()
    for variables in (github["env"], gitlab["variables"]):
        assert {"WIREVAL", "NUMBA_CACHE_DIR", "WIREVAL_CACHE"} <= variables.keys()
        assert all("/.cache/" in variables[name] for name in ("NUMBA_CACHE_DIR", "WIREVAL_CACHE"))
    assert next(step for step in github["steps"] if "cache" in step.get("uses", ""))["with"]["path"] == ".cache"
    assert gitlab["cache"]["paths"] == [".cache"]


def test_files_for_build_servers_install_wireval_and_not_the_user_s_repository() -> None:
    """`pip install .` did; nothing was kept, so that each job compiled."""
    for text in blocks(DOCS / "howto" / "ci.md", "yaml"):
        assert 'pip install "$WIREVAL"' in text
        assert "NUMBA_CACHE_DIR" in text
        assert "pip install ." not in text


def test_the_layout_of_projections_in_the_manual_is_read(tmp_path: Path) -> None:
    (text,) = blocks(DOCS / "adapters.md", "json")
    (tmp_path / "projections.json").write_text(text, encoding="utf-8")
    views = read_views(tmp_path / "projections.json", 2)
    assert [len(view.points_px) for view in views] == [3, 2]


@pytest.mark.parametrize(
    "wrong", [{"entry_mm": [0, 0]}, {"frame": "x"}, {"role": "test"}, {"wire": 3}, {"catheter": {"radius_mm": 1}}]
)
def test_the_schema_refuses_what_the_code_refuses(wrong: dict[str, Any]) -> None:
    manifest = tomllib.loads(blocks(ROOT / "README.md", "toml")[0])
    manifest["case"][0] |= wrong
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(manifest, reference_pages.manifest_schema())


def test_a_result_fits_its_schema(desk: Path) -> None:
    result = json.loads(next(desk.glob("out/cases/*/result.json")).read_text(encoding="utf-8"))
    jsonschema.validate(result, reference_pages.result_schema())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(result | {"schema": 2}, reference_pages.result_schema())


def test_what_synth_writes_as_truth_is_in_the_manual(desk: Path) -> None:
    truth = json.loads((desk / "study" / "truth.json").read_text(encoding="utf-8"))
    told = {key for keys in reference_pages.TRUTH for key in keys.split(", ")}
    assert {*truth, *(f"frames[].{key}" for key in truth["frames"][0])} == told - {"frames[].phantom_shift_mm"}


def test_the_site_has_every_page() -> None:
    """`make docs` would refuse one that is not in the contents, but it runs by itself."""
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert [label(p) for p in DOCS.rglob("*.md") if f": {p.relative_to(DOCS)}\n" not in nav] == []


def test_every_file_of_a_run_is_in_the_manual(desk: Path) -> None:
    told = re.findall(r"`([^`]+)`", (DOCS / "reference" / "files.md").read_text(encoding="utf-8"))
    out, case = desk / "out", desk / "out" / "cases" / "straight"
    for path in (*out.iterdir(), *case.iterdir(), *(case / "view").iterdir()):
        name = f"{path.name}/" * path.is_dir() or path.name
        assert name in (*told, "cases/") or name[name.find(".") :] in told, f"files.md does not tell of {path}"
