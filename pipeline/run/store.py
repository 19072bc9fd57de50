"""The keys of the store of stage results: a stage whose inputs and code have not changed is not computed again.

The key of a result is a hash of everything that it depends on, of the code that made it and of the libraries' versions:
it is made from the values that a stage is called with, so nothing can be forgotten. A file counts by its content and by
the code that reads it, never by its name or time, so that moving a study recomputes nothing.
"""

import hashlib
import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from pydantic import BaseModel

from pipeline import load
from pipeline.model import Volume
from pipeline.run.hashing import file_hash
from pipeline.run.provenance import COMPUTING, versions
from solver import Grid
from solver._compile import hash_of

_known: WeakKeyDictionary[Grid, str] = WeakKeyDictionary()


def key_of(stage: Callable[..., Any], *inputs: Any) -> str:
    """Key of what ``stage(*inputs)`` returns: its sources, the libraries, and its inputs' contents."""
    code = hash_of(Path(inspect.unwrap(stage).__code__.co_filename))
    return hashlib.sha256(f"{stage.__qualname__} {code} {versions(COMPUTING)} {digest(inputs)}".encode()).hexdigest()


def digest(value: Any) -> str:
    """SHA-256 of a value's content; TypeError for a kind of value whose content is not known."""
    if isinstance(value, Path):
        return file_hash(value) if value.exists() else "missing"
    if isinstance(value, np.ndarray):
        head = f"{value.dtype.str} {value.shape}".encode()
        content = hashlib.sha256(head)
        content.update(np.ascontiguousarray(value).data.cast("B") if value.size else b"")
        return content.hexdigest()
    if isinstance(value, np.generic):
        value = value.item()  # a number that was stored comes back as Python's own
    if isinstance(value, (str, bytes, int, float, bool, type(None))):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, Grid):
        # its arrays cannot be written to: one lumen of 50 MB is in the keys of all frames, 0.2 s each
        if value not in _known:
            _known[value] = _digest_of_parts(value)
        return _known[value]
    return _digest_of_parts(value)


def _digest_of_parts(value: Any) -> str:
    text = "\0".join(f"{name}\0{digest(part)}" for name, part in _parts(value))
    return hashlib.sha256(f"{type(value).__qualname__}\0{text}".encode()).hexdigest()


def _parts(value: Any) -> Iterator[tuple[str, Any]]:
    """The named parts of a value that has parts."""
    if isinstance(value, Enum):
        yield "name", value.name
    elif isinstance(value, BaseModel):
        yield from value
    elif is_dataclass(value):
        left_out = set()
        if isinstance(value, Volume) and value.made_of is not None:
            # a volume's source, and what read it, stand for its values: their key is cheaper to make
            left_out = {"values"}
            yield "read by", hash_of(Path(load.__file__))
        yield from ((f.name, getattr(value, f.name)) for f in fields(value) if f.name not in left_out)
    elif isinstance(value, Mapping):
        yield from ((str(name), value[name]) for name in sorted(value, key=str))
    elif isinstance(value, (list, tuple)):
        yield from ((str(i), part) for i, part in enumerate(value))
    else:
        raise TypeError(f"a {type(value).__name__} cannot be part of a key: its content is not known; got {value!r}")
