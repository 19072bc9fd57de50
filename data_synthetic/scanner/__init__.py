"""From vessels and wires to grey values: partial volume, point spread, noise; or a whole rotational X-ray run."""

from data_synthetic.scanner.phantom import Greys, Phantom
from data_synthetic.scanner.psf import PsfScanner

__all__ = ["Greys", "Phantom", "PsfScanner"]
