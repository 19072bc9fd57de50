"""Output streams whose reader may close them before the command ends: ``| head``, ``| less``."""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO, cast


class Lasting:
    """A stream that discards its output once writing has failed, so that the command ends with its own exit code.

    lost : the reason where it is not a closed pipe, such as a full disk; empty otherwise.
    """

    def __init__(self, stream: TextIO | None) -> None:
        # None where the shell closed the stream, as by `>&-`
        self._stream = stream or Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - it is the process's
        self.lost = ""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text; returns its number of characters."""
        with self._without_reader():
            try:
                self._stream.write(text)
            except UnicodeEncodeError:  # in the C locale, an umlaut in a path
                known = self._stream.encoding
                self._stream.write(text.encode(known, "backslashreplace").decode(known))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write texts; the stream's own would go past ``write``."""
        self.write("".join(lines))

    def flush(self) -> None:
        """Flush; output that cannot be written is dropped."""
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
    """Replace stdout and stderr by ``Lasting`` streams while the block runs; yields the one for stdout."""
    before = sys.stdout, sys.stderr
    out, errors = (Lasting(stream) for stream in before)
    sys.stdout, sys.stderr = cast(TextIO, out), cast(TextIO, errors)
    try:
        yield out
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        sys.stdout, sys.stderr = before
