"""Nested dataclasses to and from JSON, strictly: an unknown key is a mistake, not a comment."""

from __future__ import annotations

import dataclasses
import json
import math
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

Config = TypeVar("Config")


def to_plain(value: Any) -> Any:
    """A config as what JSON can hold; paths become text."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, tuple | list):
        return [to_plain(item) for item in value]
    if isinstance(value, float) and math.isinf(value):
        return str(value)  # JSON has no number for it
    return value


def read(cls: type[Config], file: Path) -> Config:
    """The config that a file written from `to_plain` describes. Keys left out keep their default."""
    try:
        data = json.loads(file.read_text())
    except OSError as error:
        raise ValueError(f"cannot read the config {file}: {error.strerror}") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{file} is not a JSON file: {error}") from error
    return from_plain(cls, data, where=str(file))


def from_plain(cls: type[Config], data: Any, where: str) -> Config:
    """Build cls from plain data; ValueError names the place within `where` that does not fit."""
    return typing.cast(Config, _dataclass(cls, data, where))


def _dataclass(cls: Any, data: Any, where: str) -> Any:
    if not isinstance(data, dict):
        raise ValueError(f"{where}: expected an object with the keys of {cls.__name__}, got {data!r}")
    names = [field.name for field in dataclasses.fields(cls)]
    unknown = sorted(set(data) - set(names), key=str)
    if unknown:
        raise ValueError(
            f"{where}: unknown key {', '.join(map(repr, unknown))}; valid ones: {', '.join(names)}"
        )
    hints = typing.get_type_hints(cls)
    values = {name: _value(hints[name], value, f"{where}: {name}") for name, value in data.items()}
    try:
        return cls(**values)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error


def _value(hint: Any, data: Any, where: str) -> Any:
    """One value, checked against its annotation."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        if data is None and type(None) in arguments:
            return None
        return _value(next(kind for kind in arguments if kind is not type(None)), data, where)
    if origin is typing.Literal:
        if data not in arguments:
            raise ValueError(f"{where} must be one of {', '.join(map(str, arguments))}, got {data!r}")
        return data
    if origin is tuple:
        return _tuple(arguments, data, where)
    if dataclasses.is_dataclass(hint):
        return _dataclass(hint, data, where)
    if hint is float and data in ("inf", "-inf"):
        return float(data)
    if hint is float and isinstance(data, int) and not isinstance(data, bool):
        return float(str(data))  # one beyond all floats becomes inf, like 1e999, which the config then judges
    if hint is Path and isinstance(data, str):
        return Path(data)
    if not isinstance(data, hint) or (isinstance(data, bool) and hint is not bool):
        raise ValueError(f"{where} must be a {hint.__name__}, got {data!r}")
    return data


def _tuple(arguments: tuple[Any, ...], data: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(data, list):
        raise ValueError(f"{where} must be a list, got {data!r}")
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        arguments = (arguments[0],) * len(data)
    if len(data) != len(arguments):
        raise ValueError(f"{where} must have {len(arguments)} values, got {data!r}")
    return tuple(_value(kind, item, where) for kind, item in zip(arguments, data, strict=True))
