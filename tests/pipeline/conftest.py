"""No test of this folder looks at a figure."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.unseen import few_figures as few_figures
from tests.unseen import unseen_figures as unseen_figures


@pytest.fixture
def invented(monkeypatch: pytest.MonkeyPatch) -> None:
    """Results that a test makes up have neither a key nor a ledger, and are believed."""
    monkeypatch.setattr("pipeline.run.results._unbelieved", lambda *_, **__: "")


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A store of what stages made, for the runs that a file's fixtures make."""
    folder = tmp_path_factory.mktemp("store")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("WIREVAL_CACHE", str(folder))
        yield folder


@pytest.fixture
def one_store(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same store for a test, which otherwise has one with all files."""
    monkeypatch.setenv("WIREVAL_CACHE", str(store))
