"""Real vessel trees through the pipeline (slow, and only where the data is)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.studies.anatomies import files, lines, run_tree


@pytest.mark.slow
def test_real_trees_end_in_a_status_and_are_traced(
    real_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chosen = files(real_data)
    assert len(chosen) == 6
    tables = {}
    for path in chosen:
        table, trouble = run_tree(path, tmp_path)
        with capsys.disabled():
            print("\n".join(lines(path, table, trouble)))
        assert not trouble
        tables[path.stem] = table
    for name in list(tables)[:5]:
        good = tables[name][tables[name]["status"] == "ok"]
        assert len(good) >= len(tables[name]) // 2, name
        assert good["trace_mean_mm"].median() < 0.15, name
