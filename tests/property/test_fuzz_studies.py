"""Whatever stands in a study file or a table: it is taken, or refused in one sentence."""

from __future__ import annotations

import copy
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import plan_study

SCENE = """scenario: {network: a.net.xml, trajectories: fcd.xml}
cameras: {post: {mode: eulerian, position: [0, 0, 5], heading: 90}}
shots: [{camera: post, from: 0, to: 4}]
"""
STUDY = {
    "scene": "scene.yaml",
    "seed": 3,
    "common": {"quality": "draft"},
    "clip": {"camera": "post", "from": 0, "to": 1},
    "design": {
        "table": "design.csv",
        "form": "long",
        "columns": {"light": "light", "trees": ["trees"]},
        "codes": {"trees": {"1": "none"}},
        "none": {"task": 99},
    },
    "exclude": [{"light": "night", "trees": ["none"]}],
    "factors": {
        "light": {
            "about": "x",
            "levels": {"day": {"template": "city_day"}, "night": {"lights": "on"}},
        },
        "trees": {"levels": {"some": {}, "none": {"ground": {"planting": "none"}}}},
    },
    "playlists": {"order": "latin", "count": 4, "parts": 1, "repeat": 1},
    "question": {"text": "a", "answers": ["1", "2"]},
    "tools": {"write": ["jspsych"], "url": "https://example.org/"},
    "about": {"title": "a", "authors": ["b c"]},
}
TABLE = b"task,alternative,light,trees\n1,1,day,some\n1,2,day,1\n2,1,night,some\n2,2,day,none\n"

JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**12), 10**12),
    st.floats(),
    st.text(max_size=12),
    st.sampled_from(
        ["full", "fraction", "latin", "post", "day", "../x", "a.b", "{alt}", "\x00", "ü"]
    ),
    st.lists(st.integers(), max_size=3),
    st.dictionaries(st.text(max_size=6), st.integers(), max_size=3),
)


def places(value, path=()):
    """All places in a nested value."""
    yield path
    if isinstance(value, dict | list):
        for key, child in value.items() if isinstance(value, dict) else enumerate(value):
            yield from places(child, (*path, key))


def changed(path, junk):
    found = copy.deepcopy(STUDY)
    here = found
    for key in path[:-1]:
        here = here[key]
    here[path[-1]] = junk
    return found


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    (tmp_path / "a.net.xml").write_text("<net/>", encoding="utf-8")
    (tmp_path / "fcd.xml").write_text("<fcd-export/>", encoding="utf-8")
    (tmp_path / "design.csv").write_bytes(TABLE)
    return tmp_path


def plan(folder: Path, text: str) -> None:
    """Plan a study; anything but one sentence about what is wrong is a failure."""
    path = folder / "study.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        plan_study(load_study(path))
    except (ConfigError, InputError) as error:
        said = str(error)
        assert said and "\n" not in said and "Traceback" not in said


QUIETLY = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=120
)


def test_the_study_is_sound_before_anything_is_changed(folder):
    (folder / "study.yaml").write_text(yaml.safe_dump(STUDY), encoding="utf-8")
    assert len(plan_study(load_study(folder / "study.yaml")).trials) == 2


@given(st.sampled_from([path for path in places(STUDY) if path]), JUNK)
@QUIETLY
def test_junk_in_a_study_file_is_taken_or_refused(folder, path, junk):
    plan(folder, yaml.safe_dump(changed(path, junk), allow_unicode=True))


@pytest.mark.slow
@given(st.integers(0, len(TABLE)), st.binary(max_size=6), st.integers(0, 12))
@QUIETLY
def test_junk_in_a_table_is_taken_or_refused(folder, at, junk, gone):
    (folder / "design.csv").write_bytes(TABLE[:at] + junk + TABLE[at + gone :])
    plan(folder, yaml.safe_dump({**STUDY, "exclude": []}))
