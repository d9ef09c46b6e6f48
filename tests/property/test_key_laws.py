"""Odd keys and odd values anywhere in a scene: one printable sentence that names the key."""

from __future__ import annotations

import copy

import pytest
from damage import SCENE
from hypothesis import given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.scene_file import make_job

WHOLE = parse_yaml(SCENE)[0]
FREE = {("cameras",), ("roads", "per_edge"), ("vehicles", "user_models"), ("objects",)}
"""Mappings that take any key."""


def mappings(value, path=()):
    """All places of mappings in a nested value."""
    if isinstance(value, dict):
        yield path
    if isinstance(value, dict | list):
        for key, child in value.items() if isinstance(value, dict) else enumerate(value):
            yield from mappings(child, (*path, key))


def at(content, path):
    for key in path:
        content = content[key]
    return content


ODD = st.one_of(
    st.sampled_from(
        [
            *("x[0]", "[key]", "a]b[", "float", "tuple", "TableSettings", "eulerian", "{0}", "%s"),
            *(
                "a\nb",
                "a.b",
                "",
                " ",
                "x" * 300,
                "\x1b[31m",
                "\u2028",
                "preset",
                "mode[0]",
                "{x!r}",
            ),
        ]
    ),
    st.text(min_size=1, max_size=8).filter(lambda text: text.isascii()),
)
JUNK = st.sampled_from([None, True, 3, -1e9, "x", "a[b", "{}", [], [[1]], {}, {"a[0]": 1}, "x\ny"])


def said(content):
    try:
        make_job(content)
    except ConfigError as error:
        assert str(error).isprintable() and str(error)
        return str(error)
    return ""


@given(st.sampled_from(sorted(mappings(WHOLE), key=str)), ODD)
@settings(deadline=None, max_examples=200)
def test_an_unknown_key_is_named(path, key):
    content = copy.deepcopy(WHOLE)
    if key in at(content, path):
        return
    at(content, path)[key] = 1
    message = said(content)
    if path not in FREE and key.isprintable() and len(key) < 100:
        assert not message or key in message


@given(st.sampled_from(sorted(mappings(WHOLE), key=str)), JUNK)
@settings(deadline=None, max_examples=200)
def test_a_mapping_may_be_anything(path, junk):
    content = copy.deepcopy(WHOLE)
    if path:
        at(content, path[:-1])[path[-1]] = junk
    message = said(content)
    # Shots and rides name cameras and vehicles that are then not there.
    if message and path and path[0] != "cameras":
        assert str(path[0]) in message


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("lagrangian", "cameras.lagrangian.vehicle"),
        ("a[b]", "cameras.a[b].vehicle"),
        ("tuple", "cameras.tuple.vehicle"),
    ],
)
def test_a_name_is_no_branch_of_a_union(name, key):
    camera = {"mode": "lagrangian", "vehicle": [3]}
    content = {**copy.deepcopy(WHOLE), "cameras": {name: camera}}
    assert f"{key}: this should be text" in said(content)
