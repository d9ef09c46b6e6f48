"""Writes the JSON schema of study files for editors: keys, meanings and ranges."""

from __future__ import annotations

import json
from typing import Any

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.study import FactorSettings, StudySettings

TITLE = "Study file of sumo3dviz_pt"

Node = dict[str, Any]


def study_schema() -> Node:
    """Return the JSON schema of study files; in levels, editors offer the scene file's keys."""
    schema = StudySettings.model_json_schema()
    levels = schema["$defs"][FactorSettings.__name__]["properties"]["levels"]
    for place in (levels["additionalProperties"], schema["properties"]["common"]):
        place["properties"] = _scene_keys()
        place["additionalProperties"] = True  # dotted keys
    _loosen(schema)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": TITLE,
    }


def study_schema_text() -> str:
    """Return the schema as text."""
    return json.dumps(study_schema(), indent=1, ensure_ascii=False) + "\n"


def _scene_keys() -> Node:
    """Return the keys of scene files with their meanings; a patch may hold a part of a value."""
    found = Job.model_json_schema()["properties"]
    return {key: {"description": node.get("description", key)} for key, node in found.items()}


def _loosen(schema: Node) -> None:
    """Accept single words where the models hold lists, and numbers where they hold text."""
    table = schema["$defs"]["TableSettings"]["properties"]
    several = table["columns"]["additionalProperties"]
    table["columns"]["additionalProperties"] = {"anyOf": [{"type": "string"}, several]}
    word = {"type": ["string", "number", "boolean"]}
    table["none"]["additionalProperties"] = word
    listed = {"type": "array", "items": word}
    schema["properties"]["exclude"]["items"]["additionalProperties"] = {"anyOf": [word, listed]}
