"""Shared by all tests: the folder of real scans, where there is one."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

# what a script starts in the background ignores Ctrl-C, and so would all that tests start and interrupt
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def real_data() -> Path:
    """``$WIREVAL_DATA``, or skip."""
    folder = os.environ.get("WIREVAL_DATA", "")
    if not folder or not Path(folder).is_dir():
        pytest.skip("real scans are not here: set WIREVAL_DATA to their folder")
    return Path(folder)


@pytest.fixture(autouse=True)
def _own_stage_store(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """No test reads or fills the user's stage store."""
    monkeypatch.setenv("WIREVAL_CACHE", str(tmp_path_factory.getbasetemp() / "stages"))
