"""Output whose reader may go before the command ends: ``| head``, ``| less``."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO, cast


class Lasting:
    """A stream that goes nowhere once its reader has gone, so that the command ends with the exit code that it has.

    lost : why it goes nowhere where that is no reader's doing, as a full disk; empty otherwise.
    """

    def __init__(self, stream: TextIO | None) -> None:
        # Python has none where it was closed before, as by `>&-`
        self._stream = stream or Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - it is the process's
        self.lost = ""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write; the number of characters."""
        with self._without_reader():
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush; what cannot be is dropped."""
        with self._without_reader():
            self._stream.flush()

    @contextmanager
    def _without_reader(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self.lost = "" if isinstance(error, BrokenPipeError) else error.strerror or str(error)
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)


@contextmanager
def lasting() -> Iterator[Lasting]:
    """Let stdout and stderr outlast their readers; what stands for stdout, which knows what it lost."""
    before = sys.stdout, sys.stderr
    out, errors = (Lasting(stream) for stream in before)
    sys.stdout, sys.stderr = cast(TextIO, out), cast(TextIO, errors)
    try:
        yield out
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        sys.stdout, sys.stderr = before
