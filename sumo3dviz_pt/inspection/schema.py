"""Describes scene files to editors as a JSON schema: keys, meanings, ranges and names."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.values import ONE_OR_MORE, all_models
from sumo3dviz_pt.pipeline.scene_file import NAMES, names_for

TITLE = "Scene file of sumo3dviz_pt"
_OPEN = ("ground.texture",)
"""Keys that take files beside names."""

Node = dict[str, Any]


def scene_schema() -> Node:
    """Return the JSON schema of scene files, with the names that this installation knows."""
    schema = Job.model_json_schema()
    for key in NAMES:
        for place in _places(schema, schema, key.split(".")):
            _name(place, list(names_for(key)), closed=key not in _OPEN)
    _loosen(schema)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": TITLE,
        "required": ["scenario"],
    }


def schema_text() -> str:
    """Return the schema as text."""
    return json.dumps(scene_schema(), indent=1, ensure_ascii=False) + "\n"


def write_schema(path: Path, *, title: str = TITLE, text: str | None = None) -> None:
    """Write a schema; an older one is replaced, anything else is not.

    Args:
        path: Where to.
        title: The schema's.
        text: The schema; None is that of scene files.

    Raises:
        ConfigError: If something else lies there, or it cannot be written.
    """
    if path.exists() and not _is_ours(path, title):
        raise ConfigError(f"{path} is something else; move it away", key="output")
    try:
        write_atomically(path, schema_text() if text is None else text)
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error}", key="output") from error


def _is_ours(path: Path, title: str) -> bool:
    """Return whether a file is a schema of a title."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and content.get("title") == title


def _places(schema: Node, node: Node, words: list[str]) -> Iterator[Node]:
    """Yield where a key stands; `NAME` stands for any, and a key may have several meanings."""
    if "$ref" in node:
        node = schema["$defs"][node["$ref"].rpartition("/")[2]]
    for branch in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _places(schema, branch, words)
    if not words:
        if "anyOf" not in node:
            yield node
        return
    if words[0] == "NAME" and isinstance(node.get("additionalProperties"), dict):
        yield from _places(schema, node["additionalProperties"], words[1:])
    inner = node.get("properties", {}).get(words[0])
    if inner is not None:
        yield from _places(schema, inner, words[1:])


def _name(place: Node, names: list[str], *, closed: bool) -> None:
    """Let a key take names, and nothing else if it is closed."""
    if place.get("type") == "array":
        place = place["items"]
    if place.get("type") != "string":
        return
    if closed:
        place["enum"] = names
    else:
        del place["type"]
        place["anyOf"] = [{"enum": names}, {"type": "string"}]


def _metadata(annotation: Any) -> tuple[Any, ...]:
    """Return what marks a type; nothing of most."""
    return getattr(annotation, "__metadata__", ())


def _loosen(schema: Node) -> None:
    """Accept what the scene file's notation allows beside what its models hold."""
    for model in {each.__name__: each for each in all_models(Job)}.values():
        for key, field in model.model_fields.items():
            place = schema["$defs"].get(model.__name__, schema)["properties"].get(key, {})
            if ONE_OR_MORE in field.metadata:
                several = {word: place.pop(word) for word in ("type", "items")}
                place["anyOf"] = [several["items"], several]
            elif any(ONE_OR_MORE in _metadata(branch) for branch in get_args(field.annotation)):
                lists = [branch for branch in place["anyOf"] if branch.get("type") == "array"]
                place["anyOf"] += [branch["items"] for branch in lists]
    for place in schema["$defs"]["SunSettings"]["properties"]["time"]["anyOf"]:
        # Clock times have no seconds and no zone, as JSON's would.
        place.pop("format", None)
