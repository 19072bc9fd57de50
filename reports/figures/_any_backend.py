"""matplotlib, imported whatever MPLBACKEND says: figures are drawn into files, and no backend has a part in that.

Jupyter sets the variable for all that a notebook starts. A backend that is not installed where wireval is ended every
command in a ValueError.
"""

import os
import sys
from contextlib import suppress


def import_matplotlib() -> None:
    """Import it without the variable, and then choose what that names, for a notebook; one it does not know is left."""
    if "matplotlib" in sys.modules:
        return
    named = os.environ.pop("MPLBACKEND", "")
    try:
        import matplotlib as mpl
    finally:
        if named:
            os.environ["MPLBACKEND"] = named
    if named:
        with suppress(ValueError):
            mpl.rcParams["backend"] = named


import_matplotlib()
