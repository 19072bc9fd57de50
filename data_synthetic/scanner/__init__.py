"""From shapes to grey values: partial volume, point spread, noise; or a whole rotational X-ray run."""

from __future__ import annotations

from data_synthetic.scanner.psf import Greys, PsfScanner

__all__ = ["Greys", "PsfScanner"]
