"""Shared by all tests: the folder of real scans, where there is one."""

from __future__ import annotations

import gc
import os
import signal
from collections import Counter
from pathlib import Path

import pytest

# what a script starts in the background ignores Ctrl-C, and so would all that tests start and interrupt
signal.signal(signal.SIGINT, signal.default_int_handler)
# rounds of the collector over all that hundreds of tests leave in memory took a tenth of the time
gc.set_threshold(50_000, 20, 20)


LONGEST = ("test_run.py", "test_catalogue.py", "test_score.py", "test_documents.py")
"""One to three minutes each, some in two tests: begun last, every other worker would wait for them."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first, then those of most tests; each file in its own order.

    Of a test that is ``quick(n)`` all sets of parameters but the first n are slow.
    """
    met: Counter[str] = Counter()
    for item in items:
        test = item.nodeid.partition("[")[0]
        if (quick := item.get_closest_marker("quick")) and met[test] >= quick.args[0]:
            item.add_marker(pytest.mark.slow)
        met[test] += 1
    count = Counter(item.path for item in items)
    place = {name: n for n, name in enumerate(LONGEST)}
    items.sort(key=lambda item: (place.get(item.path.name, len(place)), -count[item.path], item.path))
    gc.freeze()


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
