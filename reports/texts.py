"""Small text files that may be anything, read in one place: settings, manifests, curves as JSON, what a run has left.

A FIFO blocks, a device never ends, lists within lists exhaust the stack, a number of 400 digits fits into no float:
each is refused by name, in a sentence that says what is allowed.
"""

import json
import os
import stat
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from reports.toml_words import not_toml

NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
"""A number as people and programs write one: Python also takes 1_0 for 10, and digits of other scripts."""
TEXT_BYTES, TOML_BYTES = 64 * 2**20, 16 * 2**20
"""Longest text (a curve, markups, a tree, a result), and longest TOML, which is parsed a hundred times as slowly."""
DEEPEST, LARGEST = 50, 10**300
"""Most lists and tables within each other, and the largest whole number, which a float still holds."""
KINDS = {
    stat.S_ISDIR: "a folder", stat.S_ISFIFO: "a pipe (FIFO)", stat.S_ISSOCK: "a socket", stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
}  # fmt: skip
SYSTEM = ("/proc", "/sys", "/dev")


class UnreadableError(ValueError):
    """A file that is not what it should be; the message says which, what was found, what is allowed and what to do."""


class MalformedError(UnreadableError):
    """A text that is no JSON, or no TOML, whatever it holds."""


def unreadable(what: object, why: str) -> UnreadableError:
    """The error for a file that cannot be read, and why."""
    return UnreadableError(f"{what}: {why}")


def status_of(path: Path) -> os.stat_result | None:
    """What the system says of a path, or None where nothing is there; UnreadableError for a name that cannot be one."""
    try:
        str(path).encode()
        return path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except UnicodeError:
        raise unreadable(ascii(str(path)), _not_utf8(path)) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "the name holds a zero byte"
        name = str(path) if len(str(path)) < 300 else f"{str(path)[:120]}... ({len(str(path))} characters)"
        raise unreadable(
            name, f"cannot be opened ({reason}); allowed: a file that can be read; check the path"
        ) from None


def _not_utf8(path: Path) -> str:
    """Whose fault it is that a name is no text: its own, or that of a locale in which Python takes names for ASCII."""
    try:
        os.fsencode(path).decode()
    except UnicodeError:
        return "the name is not UTF-8; allowed: names in UTF-8; rename the file"
    of_locale = f"the locale has names in {sys.getfilesystemencoding()}, and this one is in UTF-8; "
    return f"{of_locale}allowed: a locale of UTF-8; set LC_ALL=C.UTF-8 or PYTHONUTF8=1"


def size_of(path: Path, most: float = float("inf")) -> int:
    """Bytes of a regular file of at most ``most``; UnreadableError for anything else."""
    found = status_of(path)
    if found is None:
        why = "no such file or folder; check the path in the manifest (relative to the manifest itself)"
        raise unreadable(path, why)
    kind = next((name for test, name in KINDS.items() if test(found.st_mode)), "")
    if not kind and str(path.resolve()).startswith(SYSTEM):
        kind = "a file of the system"
    if kind:
        raise unreadable(path, f"this is {kind}; allowed: a regular file; name the file itself")
    if found.st_size == 0:
        raise unreadable(path, "the file is empty (0 bytes); expected content; copy it again")
    if found.st_size > most:
        size, limit = found.st_size / 2**20, most / 2**20
        raise unreadable(path, f"{size:.0f} MiB; allowed: {limit:.0f} MiB for a file of this kind; make it smaller")
    return found.st_size


def opened(path: Path, most: float = float("inf")) -> BinaryIO:
    """A regular file of at most ``most`` bytes, open for reading."""
    size_of(path, most)
    try:
        return path.open("rb")
    except OSError as error:
        raise unreadable(path, f"cannot be opened ({error.strerror}); check its permissions") from None


def read_bytes(path: Path, most: int) -> bytes:
    """A whole regular file of at most ``most`` bytes."""
    with opened(path, most) as file:
        return file.read(min(os.fstat(file.fileno()).st_size, most))  # Python sets aside as much as is asked for


def read_text(path: Path, most: int = TEXT_BYTES) -> str:
    """A whole text in UTF-8."""
    try:
        return read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        why = f"not UTF-8 text (byte {error.start}); allowed: a text file in UTF-8; save it again"
        raise unreadable(path, why) from None


def read_json(path: Path, what: str) -> Any:
    """The content of a JSON file. what : it should be, in words."""
    text = read_text(path)

    def refusal(error: Exception) -> str:
        return f"{path}: {error if isinstance(error, TwiceError) else 'no JSON'}; expected {what}; write it again"

    return _parsed(path, lambda: json.loads(text, object_pairs_hook=_once), refusal)


class TwiceError(ValueError):
    """A key that stands twice in one object, of which a parser keeps the last."""


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON; TwiceError where a key stands twice with two values."""
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found and found[key] != value:
            raise TwiceError(f"two values of the key {key[:40]!r}")
        found[key] = value
    return found


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file."""
    return toml_of(read_text(path, TOML_BYTES), path)


def toml_of(text: str, where: object) -> dict[str, Any]:
    """The tables of a TOML text, which stands at ``where``."""
    found: dict[str, Any] = _parsed(where, lambda: tomllib.loads(text), lambda error: not_toml(where, text, error))
    return found


def _parsed(where: object, parse: Callable[[], Any], refusal: Callable[[Exception], str]) -> Any:
    """What a parser makes of a text, if programs can go on with it. refusal : the sentence on what is no such text."""
    try:
        data = parse()
    except RecursionError:
        raise _too_deep(where) from None
    except ValueError as error:
        if type(error) is ValueError:  # not the parser's: Python converts no whole number of more than 4300 digits
            raise _too_large(where) from None
        raise MalformedError(refusal(error)) from None
    level, depth = [data], 0
    while level:
        depth += 1
        if depth > DEEPEST + 1:
            raise _too_deep(where)
        inside = [item for one in level if isinstance(one, (dict, list)) for item in _items(one)]
        if any(isinstance(item, int) and abs(item) > LARGEST for item in inside):
            raise _too_large(where)
        level = [item for item in inside if isinstance(item, (dict, list))]
    return data


def _items(one: Any) -> Any:
    return one.values() if isinstance(one, dict) else one


def _too_deep(where: object) -> UnreadableError:
    return unreadable(where, f"lists or tables more than {DEEPEST} deep in each other; allowed: {DEEPEST}; correct it")


def _too_large(where: object) -> UnreadableError:
    return unreadable(where, "a whole number of more than 300 digits; allowed: up to 1e300; correct it")
