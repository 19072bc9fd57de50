"""Progress: a line per finished frame where there is no terminal, everything in the log."""

from __future__ import annotations

import io
from pathlib import Path

from pipeline.run.log import CaseProgress


class Terminal(io.StringIO):
    """A stream that says that it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_lines_elsewhere_and_everything_in_the_log(tmp_path: Path) -> None:
    stream = io.StringIO()
    progress = CaseProgress("a", tmp_path / "log.txt", stream)
    progress("trace", 1, 2, "ok 12.0 mm")
    progress("simulate", 1, 2, "converged")
    progress.say("compiling")
    assert stream.getvalue() == "[a] trace 1/2  ok 12.0 mm\n[a] compiling\n"
    log = (tmp_path / "log.txt").read_text(encoding="utf-8")
    assert "simulate 1/2  converged" in log
    assert "compiling" in log


def test_a_bar_on_a_terminal(tmp_path: Path) -> None:
    stream = Terminal()
    progress = CaseProgress("a", tmp_path / "log.txt", stream)
    for i in range(3):
        progress("trace", i + 1, 3, "ok")
    progress.close()
    assert "a trace" in stream.getvalue()
    assert "[a] trace 1/3" not in stream.getvalue()


def test_quiet_means_the_log_alone(tmp_path: Path) -> None:
    stream = io.StringIO()
    progress = CaseProgress("a", tmp_path / "log.txt", stream, quiet=True)
    progress("trace", 1, 1, "ok")
    progress.say("x")
    assert stream.getvalue() == ""
    assert "trace 1/1" in (tmp_path / "log.txt").read_text(encoding="utf-8")
