"""Error messages for values that a validation refused: where, what was found, what is allowed, what to do.

pydantic reports in its own words, once for each branch of a union and with the names of Python's types. Here one
sentence per key is made from the JSON schema of the model.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import date, time
from difflib import get_close_matches
from typing import Any

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from pipeline.status import did_you_mean

Place = tuple[int | str, ...]
"""The path to a value in the user's input: keys, and positions in lists."""
Schema = Mapping[str, Any]
OWN, WHOLE_CASE = "value_error", "whole_case"
"""pydantic error types whose messages are written here: on one key, and on a whole case."""
WRITTEN_HERE: dict[str, Any] = {"not": {}}
"""JSON schema of a field that the program fills in and no user may write."""
UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
LIMITS = {"exclusiveMinimum": "above", "minimum": "from", "exclusiveMaximum": "below", "maximum": "to"}
SIGMAS = "case.uncertainty"
"""The table whose keys are standard deviations of what other tables state."""
VAST = 1e6  # bounds from here on guard against overflow: named only to a user who exceeds one
KINDS = {"number": "a number", "integer": "a whole number", "boolean": "true or false", "string": "a text"}
SEVERAL = {"number": "numbers", "integer": "whole numbers", "string": "texts", "object": "tables"}
LONGEST = 60


def sentences(error: ValidationError, data: Any, schema: Schema) -> Iterator[tuple[Place, str]]:
    """(place, sentence) for each wrong key of ``data``, which was validated against a model with this JSON schema."""
    groups: dict[Place, list[tuple[Place, Mapping[str, Any]]]] = {}
    for item in error.errors():
        place = _written(data, item["loc"])
        if item["type"] == WHOLE_CASE:
            yield from ((place[:2], f": {problem}") for problem in item["ctx"]["problems"])
        elif item["type"] in UNKNOWN:
            yield place, _no_such_key(schema, place, _value(data, place))
        elif item["type"] == "missing" and isinstance(key := item["loc"][-1], str):
            yield (*place, key), MISSING
        elif item["type"] != "default_factory_not_called":  # it depends on another key, which has an error of its own
            groups.setdefault(_key_of(place), []).append((place, item))
    for key_place, items in groups.items():
        owns = [(place, item["msg"]) for place, item in items if item["type"] == OWN]
        if owns:
            # of a whole table in a list, a case, its number tells which
            yield from ((place, f": {m.removeprefix('Value error, ')}") for place, m in owns)
        else:
            place = max((place for place, _ in items), key=len)
            yield _refused(data, key_place, place, schema)


MISSING = ": missing; this key is required"


def saying(*problems: str) -> PydanticCustomError:
    """A pydantic error whose message consists of these sentences alone."""
    return PydanticCustomError(WHOLE_CASE, "{problems}", {"problems": problems})


def said(place: Sequence[int | str], sentence: str) -> str:
    """One of ``sentences`` with its place in front: keys separated by blanks, list positions in brackets."""
    words = [f"[{part}]" if isinstance(part, int) else f" {part}" for part in place]
    return ("".join(words).strip() + sentence).removeprefix(": ")


def expected(found: Any, node: Schema, definitions: Schema, *, optional: bool) -> str:
    """``= found: expected ...; do this`` for a value that a schema does not allow."""
    many = [part for part in _numbers(found) if not abs(part) < VAST]
    words = in_words(node, definitions, exact=bool(many), null=False)
    return f" = {shortened(as_toml(found))}: expected {words}; {_what_to_do(found, node, definitions, optional)}"


def _refused(data: Any, key: Place, place: Place, schema: Schema) -> tuple[Place, str]:
    """(place, sentence) on one key: on its whole value or, where that is long, on the entry that is wrong."""
    node, needed = _node(schema, key)
    whole = _value(data, key)
    where = key if len(as_toml(whole)) <= LONGEST else place
    words = expected(_value(data, where), node, schema.get("$defs", {}), optional=not needed)
    if isinstance(whole, float) and 0.0 < whole < 1e-3 and str(key[-1]).endswith("_mm"):
        words += f"; is it in metres ({1e3 * whole:g} mm)?"
    return where, words


def _written(data: Any, location: Sequence[int | str]) -> Place:
    """pydantic's location of an error as a place in ``data``: without its names for the branches of a union."""
    place: list[int | str] = []
    for part in location:
        inside = part in data if isinstance(data, dict) else isinstance(part, int) and part < _length(data)
        if inside:
            place.append(part)
            data = data[part]
    return tuple(place)


def _length(data: Any) -> int:
    return len(data) if isinstance(data, list) else 0


def _key_of(place: Place) -> Place:
    """The place up to its last key: a list counts as one value."""
    last = max((n for n, part in enumerate(place) if isinstance(part, str)), default=-1)
    return place[: last + 1]


def _value(data: Any, place: Place) -> Any:
    for part in place:
        data = data[part]
    return data


def _branches(node: Schema, definitions: Schema) -> Iterator[Schema]:
    """The alternatives that a schema allows, with references resolved."""
    if "$ref" in node:
        yield from _branches(definitions[node["$ref"].rpartition("/")[2]], definitions)
    elif "anyOf" in node:
        for one in node["anyOf"]:
            yield from _branches(one, definitions)
    else:
        yield node


def _node(schema: Schema, place: Place) -> tuple[Schema, bool]:
    """The schema of a place, and whether its key is required."""
    definitions = schema.get("$defs", {})
    node, needed = schema, True
    for part in place:
        options = list(_branches(node, definitions))
        if isinstance(part, int):
            node = next((one["items"] for one in options if "items" in one), {})
            continue
        owner = next((one for one in options if part in one.get("properties", {})), None)
        if owner is not None:
            node, needed = owner["properties"][part], part in owner.get("required", ())
        else:  # a table whose keys the user chooses
            node = next((one["additionalProperties"] for one in options if one.get("additionalProperties")), {})
    return node, needed


def _no_such_key(schema: Schema, place: Place, found: Any) -> str:
    key, here = str(place[-1]), ".".join(part for part in place[:-1] if isinstance(part, str))
    if isinstance(found, list) and found and isinstance(found[0], dict):
        found = found[0]  # [[wall]] for [case.wall]
    own = _keys(schema, place[:-1])
    homes = {name: header for name, header, keys in _tables(schema, schema) if _is_key(keys.get(key), schema, found)}
    if not homes or any(name.startswith(f"{key.lower()}_") for name in own):  # the latter lacks its unit alone
        return f": unknown key; {did_you_mean(key, own)}"
    if here == SIGMAS and isinstance(found, (int, float)) and "_sigma_" not in key:
        sigma = _sigma_of(key, _keys(schema, place[:-2]))
        both = f"{key} is a key of [[case]], and how well it is known is {sigma}"
        known = sigma and f"{both}: write the one that is meant above [{here}]"
        return f": unknown key; {known or 'allowed: ' + ', '.join(sorted(own))}"
    if isinstance(found, dict):
        where = f"write {' or '.join(f'[{name}.{key}]' for name in homes)}"
    else:
        around = any(here.startswith(f"{name}.") for name in homes)
        where = f"write it above [{here}]" if around else "write it there"
    told = [f"{header} (its standard deviation)" if name == SIGMAS else header for name, header in homes.items()]
    return f": unknown key; it is a key of {' or '.join(told)}: {where}"


def _sigma_of(key: str, names: Sequence[str]) -> str:
    """Which of these keys is the standard deviation of another one, as roll_sigma_deg of roll_deg; empty for none."""
    stem, _, unit = key.rpartition("_")
    return next((name for name in names if name == f"{stem}_sigma_{unit}" or name.startswith(f"{key}_sigma_")), "")


def _is_key(node: Schema | None, schema: Schema, found: Any) -> bool:
    """Whether a table with this node for a key, if any, takes what was found there: a table, or something else."""
    if node is None or node == WRITTEN_HERE:
        return False
    tables = [one.get("type") == "object" for one in _branches(node, schema.get("$defs", {}))]
    return any(tables) if isinstance(found, dict) else not all(tables)


def _tables(schema: Schema, node: Schema, name: str = "") -> Iterator[tuple[str, str, Schema]]:
    """(name, header, keys) of every table within one, those below [[double brackets]] and under chosen names, too."""
    for key, of in node.get("properties", {}).items():
        inside = f"{name}.{key}".strip(".")
        for one in _branches(of, schema.get("$defs", {})):
            several, chosen = one.get("items", {}), one.get("additionalProperties") or {}
            at, header = (f"{inside}.NAME", f"[{inside}.NAME]") if chosen else (inside, f"[{inside}]")
            header = f"[[{inside}]]" if several else header
            for table in _branches(several or chosen or one, schema.get("$defs", {})):
                if "properties" in table:
                    yield at, header, table["properties"]
                    yield from _tables(schema, table, at)


def _keys(schema: Schema, place: Place) -> list[str]:
    """The keys that a user may write in the table at a place."""
    node, _ = _node(schema, place)
    options = _branches(node, schema.get("$defs", {}))
    return [name for one in options for name, of in one.get("properties", {}).items() if of.get("not") != {}]


def _numbers(found: Any) -> Iterator[float]:
    """Every number in a value, those in nested lists included."""
    if isinstance(found, (list, tuple)):
        for one in found:
            yield from _numbers(one)
    elif isinstance(found, (int, float)) and not isinstance(found, bool):
        yield found


def _what_to_do(found: Any, node: Schema, definitions: Schema, optional: bool) -> str:
    options = list(_branches(node, definitions))
    if isinstance(found, str):
        if any(one.get("type") in ("number", "integer") for one in options) and _is_number(found):
            return "write it without quotes"
        choices = [str(one) for option in options for one in option.get("enum", [option.get("const", "")]) if one]
        if close := get_close_matches(found, choices, n=1):
            return f"did you mean {close[0]!r}?"
    if not optional:
        return "correct it"
    default = node.get("default")
    plain = isinstance(default, (int, float)) or (isinstance(default, str) and default)
    return "correct it, or leave it out" + (f" for {as_toml(default)}" if plain else "")


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def as_toml(value: Any) -> str:
    """A value as text in TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {as_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    if isinstance(value, (date, time)):
        return value.isoformat()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps(value, ensure_ascii=False, default=str)


def shortened(text: str, longest: int = LONGEST) -> str:
    """A text of at most ``longest`` characters."""
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def in_words(node: Schema, definitions: Schema | None = None, *, exact: bool = False, null: bool = True) -> str:
    """What a JSON schema allows, in words.

    exact : name the bounds that only guard against overflow, too.     null : say, too, that a value may be left out.
    """
    how: dict[str, Any] = {"exact": exact, "null": null}
    if "$comment" in node:
        return str(node["$comment"])
    if "$ref" in node:
        return "a table"
    if "anyOf" in node:
        words = [in_words(one, definitions, **how) for one in node["anyOf"] if null or one.get("type") != "null"]
        return " or ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
    if "const" in node or "enum" in node:
        return " or ".join(json.dumps(value) for value in node.get("enum", [node.get("const")]))
    if node.get("type") == "null":
        return "left out"
    if node.get("type") == "array":
        return _list_in_words(node, definitions, how)
    return KINDS.get(node.get("type", ""), "a table") + _limits(node, exact)


def _limits(node: Schema, exact: bool) -> str:
    limits = {
        word: node[key] for key, word in LIMITS.items() if exact or abs(node.get(key, VAST)) < VAST if key in node
    }
    if "maxLength" in node:
        least = f"{node['minLength']} to" if node.get("minLength") else "at most"
        return f" of {least} {node['maxLength']} characters"
    return "".join(f" {word} {bound:g}".replace("e+0", "e") for word, bound in limits.items())


def _list_in_words(node: Schema, definitions: Schema | None, how: Mapping[str, Any]) -> str:
    parts, items = node.get("prefixItems", []), node.get("items", {})
    if node.get("maxItems") == 0:
        return "empty"
    if parts and all(part == parts[0] for part in parts):
        each = _limits(parts[0], how["exact"])
        one = "number" if parts[0].get("type") == "number" else in_words(parts[0], definitions, **how)
        return f"[{', '.join([one] * len(parts))}]" + f", each{each}" * bool(each)
    least = "a list (not empty) of " if node.get("minItems") else "a list of "
    if "$comment" not in items and items.get("type") in SEVERAL and "pattern" not in items:
        return least + SEVERAL[items["type"]] + _limits(items, how["exact"])
    return least + (
        "tables, each under its name in [[double brackets]]" if "$ref" in items else in_words(items, definitions, **how)
    )
