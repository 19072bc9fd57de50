"""Error messages for files that are not valid TOML: where, the line, what is allowed."""

import re

_PLACE = re.compile(r" \(at line (\d+), column \d+\)$")
_COMMA = re.compile(r"= *([+-]?\d+),(\d+)\s*(?:#.*)?$")  # of several commas one may part thousands, or a list
_AT_END = "end of document"
_SHOWN = 60
_VALUE = "a value is a number, true or false, a text in quotes, or a list in brackets"
ALLOWED = {
    "table declaration": "a table is [name], a case [[case]], on a line of its own",
    "array declaration": "a table is [name], a case [[case]], on a line of its own",
    "after a key": "a line is key = value",
    "Invalid value": _VALUE,
    "Invalid initial character for a key": "a line is key = value, with letters, digits, - and _ in the key",
    "after a statement": f"a line is one key = value; {_VALUE}",
    "overwrite": "a key stands once in its table",
    "Cannot declare": "a table stands once; only [[case]] is repeated",
    "mutate": "a table stands once, in one place",
    "Unclosed array": "a list has commas between its parts and ends with ]",
    "string": "a text ends with the quote it begins with, on its line; \\\\ stands for a backslash",
    "Illegal character": "a text ends with the quote it begins with, on its line",
    "escape": "in double quotes \\\\ stands for a backslash; single quotes take it as it is",
}
"""What is allowed, by a piece of the parser's error message."""


def not_toml(where: object, text: str, error: Exception) -> str:
    """The error message for ``text``, read from ``where``, which tomllib refused with ``error``."""
    said = str(error)
    general = f"a line is key = value, [table] or # a comment; {_VALUE}"
    allowed = next((words for piece, words in ALLOWED.items() if piece in said), general)
    line = _line(text, said)
    number = _COMMA.search(line)
    point = f"; write decimals with a point: {number[1]}.{number[2]}" if number else ""
    return f"{where}{line}: not valid TOML; {allowed}{point}"


def _line(text: str, said: str) -> str:
    """Number and text of the line that the parser named; empty where it named none."""
    lines, place = text.splitlines(), _PLACE.search(said)
    number = int(place[1]) if place else len(lines) if _AT_END in said else 0
    if not 0 < number <= len(lines):
        return ""
    line = lines[number - 1].strip()
    return f", line {number}: {line if len(line) <= _SHOWN else f'{line[: _SHOWN - 3]}...'}"
