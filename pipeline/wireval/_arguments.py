"""Of which kind arguments of a verb may be: one of another kind is refused by its name, before anything is done."""

from collections.abc import Callable, Collection, Mapping
from os import PathLike
from pathlib import Path
from typing import TypeGuard

from pipeline.cli import parsers
from pipeline.status import InputError
from pipeline.wording import shortened
from reports.case_files import CaseFiles
from reports.texts import UnreadableError, status_of


def _is_place(value: object) -> bool:
    """Whether it is a path; UnreadableError for a name that no file can have."""
    if isinstance(value, (str, PathLike)) and str(value):
        status_of(Path(value))
        return True
    return False


def _are_places(value: object) -> bool:
    """Whether it is a path, a list of them, or paths by name."""
    if isinstance(value, Mapping):
        return all(isinstance(name, str) and _is_place(place) for name, place in value.items())
    return isinstance(value, str) or _is_place(value) or _are_words(value, (str, PathLike))


def _is_list(value: object) -> TypeGuard[Collection[object]]:
    return isinstance(value, Collection) and not isinstance(value, (str, bytes, Mapping))


def _are_words(value: object, of: type | tuple[type, ...] = str) -> bool:
    """Whether it is text, or a list of such."""
    return isinstance(value, str) or (_is_list(value) and all(isinstance(one, of) for one in value))


def _are_values(value: object) -> bool:
    """Whether it is lists of values by the keys of settings."""
    return isinstance(value, Mapping) and all(isinstance(k, str) and _is_list(v) for k, v in value.items())


PLACE = _is_place, "a path, as text or pathlib.Path"
ALLOWED: dict[str, tuple[Callable[[object], bool], str]] = {
    "scene": (lambda value: isinstance(value, str), "the name of a scene, as text"),
    **dict.fromkeys(("manifest", "out", "first", "second", "tolerance"), PLACE),
    "settings": (
        lambda value: isinstance(value, Mapping),
        'a mapping, {"segment.threshold": 0.5}, with the keys that --set takes',
    ),
    "sweep": (_are_values, 'a mapping to lists of values, {"simulate.wall_scale": [0.5, 2]}'),
    "fail_if": (_are_words, 'a condition as text, "rms_mm>0.5", or a list of such'),
    "curves": (_are_places, '"NAME=FOLDER" or a path, a list of these, or {"NAME": FOLDER}'),
    "case": (lambda value: isinstance(value, CaseFiles), 'a case of the results, results.cases["ID"]'),
}
"""By the name of an argument: which values it may have, and these in words."""


def require(**given: object) -> None:
    """Raise InputError for the first argument of a kind that it may not be, or a name that no file can have."""
    for name, value in given.items():
        fits, expected = ALLOWED[name]
        try:
            if not fits(value):
                raise InputError([f"{name}: got {shortened(repr(value), 80)}; expected {expected}"])
        except UnreadableError as error:
            raise InputError([f"{name}: {error}"]) from None


def require_truth(verb: str, options: Mapping[str, object]) -> None:
    """Raise InputError for the first option without a value, as ``quiet``, that is neither True nor False.

    Its value was an argument too many: "yes: not an option of wireval run".
    """
    known = parsers()[1][verb]._option_string_actions
    for name, value in options.items():
        action = known.get(f"--{name.replace('_', '-')}")
        if action is not None and action.nargs == 0 and not (value is None or isinstance(value, bool)):
            raise InputError([f"{name}: got {shortened(repr(value), 80)}; expected True or False"])
