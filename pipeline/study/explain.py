"""What every setting means, what it may be and what it is by default, read from where it is declared."""

import ast
import inspect
import json
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any, get_type_hints

from pydantic import TypeAdapter

from pipeline.study.settings import Config
from pipeline.wording import in_words


@dataclass(frozen=True)
class Described:
    """One setting. allowed : its kind, range or choices in words."""

    table: str
    key: str
    meaning: str
    allowed: str
    default: Any

    @property
    def name(self) -> str:
        """As --set takes it."""
        return f"{self.table}.{self.key}"

    @property
    def value(self) -> str:
        """The default as TOML writes it; empty where it is left out, and taken from the data or the manifest."""
        return "" if self.default is None else json.dumps(self.default, ensure_ascii=False)

    @property
    def toml(self) -> str:
        """The meaning as a comment, then a line to change: the default and what is allowed."""
        words = textwrap.wrap(self.meaning, 112)
        line = f"{self.key} = {self.value}" if self.value else f"# {self.key} is left out"
        return "\n".join([*(f"# {part}" for part in words), f"{line}  # {self.allowed}"])


def described() -> Iterator[Described]:
    """Every setting, table by table, in the order of its declaration."""
    config = Config()
    for table in fields(config):
        values = getattr(config, table.name)
        kinds, meanings = get_type_hints(type(values), include_extras=True), _sentences(type(values))
        for item in fields(values):
            schema = TypeAdapter(kinds[item.name]).json_schema()
            default = getattr(values, item.name)
            yield Described(table.name, item.name, meanings.get(item.name, ""), in_words(schema), default)


def _sentences(kind: type) -> dict[str, str]:
    """The text below each field of a class, by the field's name."""
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    assert isinstance(body, ast.ClassDef)
    pairs = zip(body.body, body.body[1:], strict=False)
    return {
        field.target.id: " ".join(text.value.value.split())
        for field, text in pairs
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) and isinstance(text.value.value, str)
    }
