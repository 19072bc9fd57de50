"""Whether the packages that wireval brings are those that Python finds: a user's own solver.py is found first.

Imported before any of them, since Python itself says no more than "No module named 'solver.grid'".
"""

import sys
from importlib.util import find_spec
from pathlib import Path

OURS = {"data_synthetic": "catalogue", "pipeline": "cli.py", "reports": "columns.toml", "solver": "_kernels"}
"""The packages, each with something that a stranger of that name does not hold."""


def in_the_way(name: str) -> Path | None:
    """The file or folder that Python takes for one of our packages; None where it finds ours, or nothing."""
    known = sys.modules.get(name)
    spec = getattr(known, "__spec__", None) if known else find_spec(name)
    places = list((spec.submodule_search_locations if spec else getattr(known, "__path__", None)) or ())
    if any((Path(place) / OURS[name]).exists() for place in places) or not (spec or known):
        return None
    file = (spec.origin if spec else None) or getattr(known, "__file__", None)
    return Path(file or next(iter(places), name))


def refuse_others() -> None:
    """Raise ImportError that names what is in the way of one of our packages, and what to do."""
    for name in OURS:
        if found := in_the_way(name):
            place = found.parent if found.name == "__init__.py" else found
            raise ImportError(
                f"{place} is in the way: wireval brings a package {name!r}, and Python finds this one first; "
                "rename it, or move the script to another folder",
                name=name,
                path=str(place),
            )


refuse_others()
