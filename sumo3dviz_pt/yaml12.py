"""YAML as people expect it: 1.2 core types, no duplicate keys, places for messages.

PyYAML speaks YAML 1.1, in which `12:30` is 750, `on` is true and a repeated key
silently wins. This module resolves scalars by the YAML 1.2 core schema instead.

References:
    YAML 1.2.2, chapter 10.3 (core schema), https://yaml.org/spec/1.2.2/
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from sumo3dviz_pt.errors import ConfigError

KeyPath = tuple[str | int, ...]
Places = dict[KeyPath, tuple[int, int]]


class _Loader(yaml.SafeLoader):
    """A safe loader with the core schema's resolvers only."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012


_CORE = (
    ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", "tTfF"),
    ("int", r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$", "-+0123456789"),
    (
        "float",
        r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$",
        "-+.0123456789",
    ),
    ("null", r"^(?:~|null|Null|NULL|)$", "~nN\0"),
    ("merge", r"^<<$", "<"),
)
for _tag, _pattern, _first in _CORE:
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_tag}",
        re.compile(_pattern),
        ["" if char == "\0" else char for char in _first],
    )


def _core_int(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    """Read an integer; a leading zero is decimal in YAML 1.2."""
    text = str(loader.construct_scalar(node))
    return int(text, 0) if text.startswith(("0o", "0x")) else int(text)


def _core_float(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    """Read a real number."""
    return float(
        re.sub(r"^([-+]?)\.(inf|nan)$", r"\1\2", str(loader.construct_scalar(node)).lower())
    )


_Loader.add_constructor("tag:yaml.org,2002:int", _core_int)
_Loader.add_constructor("tag:yaml.org,2002:float", _core_float)


def parse_yaml(text: str, *, file: str | Path | None = None) -> tuple[Any, Places]:
    """Parse a document.

    Returns:
        The value, and for every key path the line and column, from 1, of its key.

    Raises:
        ConfigError: If it is no YAML, or a key occurs twice.
    """
    try:
        loader = _Loader(text)
    except yaml.YAMLError as error:
        reason = str(error).splitlines()[0]
        raise ConfigError(f"this is not valid YAML: {reason}", file=file) from error
    try:
        node = loader.get_single_node()
        places: Places = {}
        _walk(node, (), places, file)
        return (None if node is None else loader.construct_document(node)), places
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        raise ConfigError(
            f"this is not valid YAML: {error.problem}",
            file=file,
            line=mark.line + 1 if mark else None,
            column=mark.column + 1 if mark else None,
        ) from error
    except RecursionError as error:
        raise ConfigError("this YAML is nested too deeply, or in itself", file=file) from error
    finally:
        loader.dispose()


def _walk(node: yaml.Node | None, path: KeyPath, places: Places, file: str | Path | None) -> None:
    """Note where every key stands and refuse duplicates."""
    if isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            places[(*path, index)] = (item.start_mark.line + 1, item.start_mark.column + 1)
            _walk(item, (*path, index), places, file)
    if not isinstance(node, yaml.MappingNode):
        return
    for key, value in node.value:
        here = (*path, str(key.value))
        place = (key.start_mark.line + 1, key.start_mark.column + 1)
        if here in places:
            raise ConfigError(
                f"the key stands twice, first in line {places[here][0]}; remove one",
                key=".".join(map(str, here)),
                file=file,
                line=place[0],
                column=place[1],
            )
        places[here] = place
        _walk(value, here, places, file)
