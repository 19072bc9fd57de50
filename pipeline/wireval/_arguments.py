"""What arguments of a verb may be: one of another kind is refused by its name, before anything is done."""

import os
from collections.abc import Callable, Mapping
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.cli import parsers
from pipeline.status import InputError
from pipeline.wording import shortened
from reports.case_files import CaseFiles
from reports.texts import UnreadableError, status_of


def _text(value: object) -> str | None:
    return value if isinstance(value, str) and value else None


def _place(value: Any) -> str | None:
    """A path as text; UnreadableError for a name that no file can have."""
    try:
        name = _text(os.fspath(value))
    except TypeError:
        return None
    if name is not None:
        status_of(Path(name))
    return name


def _list(value: Any) -> list[Any] | None:
    """What can be gone through and is no text, gone through once: a generator has its values no second time."""
    if isinstance(value, (str, bytes, Mapping)):
        return None
    try:
        each = iter(value)
    except TypeError:
        return None
    return list(each)


def _whole(found: list[Any | None]) -> list[Any] | None:
    """All of these, None where one of them is."""
    return None if None in found else found


def _conditions(value: object) -> list[str] | None:
    listed = [value] if isinstance(value, str) else _list(value)
    return None if listed is None else _whole([_text(one) for one in listed])


def _curves(value: object) -> list[str] | None:
    """As --curves takes them: "NAME=FOLDER", or a path alone."""
    if isinstance(value, Mapping):
        pairs = [(_text(name), _place(place)) for name, place in value.items()]
        return None if any(None in pair for pair in pairs) else [f"{name}={place}" for name, place in pairs]
    listed = [value] if isinstance(value, (str, os.PathLike)) else _list(value)
    return None if listed is None else _whole([_text(one) or _place(one) for one in listed])


def _values(value: object) -> dict[str | None, list[Any] | None] | None:
    """Lists of values by the keys of settings."""
    if not isinstance(value, Mapping):
        return None
    found = {_text(name): _list(values) for name, values in value.items()}
    return None if None in found or None in found.values() else found


def _count(value: Any) -> int | None:
    """A whole number, numpy's too; True is none."""
    return int(value) if isinstance(value, Integral) and value is not True and int(value) >= 1 else None


PLACE = _place, "a path, as text or pathlib.Path"
ALLOWED: dict[str, tuple[Callable[[object], Any], str]] = {
    "scene": (_text, "the name of a scene, as text"),
    **dict.fromkeys(("manifest", "out", "first", "second", "tolerance"), PLACE),
    "settings": (
        lambda value: value if isinstance(value, Mapping) else None,
        'a mapping, {"segment.threshold": 0.5}, with the keys that --set takes',
    ),
    "jobs": (_count, "a whole number from 1 on"),
    "sweep": (_values, 'a mapping to lists of values, {"simulate.wall_scale": [0.5, 2]}'),
    "fail_if": (_conditions, 'a condition as text, "rms_mm>0.5", or a list of such'),
    "curves": (_curves, '"NAME=FOLDER" or a path, a list of these, or {"NAME": FOLDER}'),
    "case": (
        lambda value: value if isinstance(value, CaseFiles) else None,
        'a case of the results, results.cases["ID"]',
    ),
}
"""By the name of an argument: what its value is taken as, None for one that it may not have, and these in words."""
OPTIONAL = "settings", "jobs", "sweep", "tolerance"
"""None is their default."""


def require(**given: object) -> dict[str, Any]:
    """The arguments as they are taken: paths as text, and lists of what can be gone through.

    Raises InputError for the first of a kind that it may not be, or a name that no file can have.
    """
    return {
        name: None if value is None and name in OPTIONAL else _taken(name, value, *ALLOWED[name])
        for name, value in given.items()
    }


def _taken(name: str, value: object, take: Callable[[object], Any], expected: str) -> Any:
    try:
        found = take(value)
    except UnreadableError as error:
        raise InputError([f"{name}: {error}"]) from None
    if found is None:
        raise InputError([f"{name}: got {shortened(repr(value), 80)}; expected {expected}"])
    return found


def with_flags(verb: str, options: Mapping[str, object]) -> dict[str, object]:
    """The options; those without a value, as ``quiet``, as Python's own True, False or None, numpy's too.

    Raises InputError for the first that is none of them: its value was an argument too many, "yes: not an option of
    wireval run".
    """
    known, taken = parsers()[1][verb]._option_string_actions, dict(options)
    for name, value in options.items():
        action = known.get(f"--{name.replace('_', '-')}")
        if action is not None and action.nargs == 0 and value is not None:
            if not isinstance(value, (bool, np.bool_)):
                raise InputError([f"{name}: got {shortened(repr(value), 80)}; expected True or False"])
            taken[name] = bool(value)
    return taken


def typed(name: str, value: object) -> str:
    """The value of an option as it is typed; InputError for a path that is no text."""
    return str(_taken(name, value, *PLACE) if isinstance(value, (os.PathLike, bytes)) else value)
