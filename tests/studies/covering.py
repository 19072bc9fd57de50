"""A plugin of pytest: which test executes which line, for `make coverage`. Needs the package coverage.

Lines that are executed outside of tests (imports, constants) belong to none. Compiled kernels are not seen.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import coverage
import pytest


class Covering:
    """Names the test that is at work to the coverage."""

    def __init__(self) -> None:
        self.cover: Any = coverage.Coverage(
            data_file=os.environ["COVERING"],
            data_suffix=True,
            source=["pipeline", "reports", "data_synthetic", "solver"],
        )

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self.cover.switch_context(item.nodeid)
        yield
        self.cover.switch_context("")

    def pytest_sessionfinish(self) -> None:
        self.cover.stop()
        self.cover.save()


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("numprocesses", None) and not hasattr(config, "workerinput"):
        return  # it hands out the tests, and executes none
    plugin = Covering()
    plugin.cover.start()
    config.pluginmanager.register(plugin)
