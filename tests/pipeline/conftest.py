"""No test of this folder looks at a figure."""

import pytest

from tests.unseen import few_figures as few_figures
from tests.unseen import unseen_figures as unseen_figures


@pytest.fixture
def invented(monkeypatch: pytest.MonkeyPatch) -> None:
    """Results that a test makes up have neither a key nor a ledger, and are believed."""
    monkeypatch.setattr("pipeline.run.results._unbelieved", lambda *_, **__: "")
