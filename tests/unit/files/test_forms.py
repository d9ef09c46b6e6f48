"""Files of older versions are understood with a note, newer ones are refused in a sentence."""

import logging
from types import MappingProxyType

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.forms import SCHEMA_VERSION, UPDATE, Form


def _longer(content):
    """Version 2 has a list where version 1 has a word."""
    if "word" not in content:
        return content, ""
    rest = {key: value for key, value in content.items() if key != "word"}
    return {**rest, "words": [content["word"]]}, "its word stands in a list now"


def _counted(content):
    """Version 3 has their number."""
    return {**content, "count": len(content["words"])}, "its words are counted now"


FORM = Form("book", 3, MappingProxyType({1: _longer, 2: _counted}))


@pytest.mark.parametrize("old", [{"word": "a"}, {"word": "a", SCHEMA_VERSION: 1}])
def test_every_step_from_an_older_version_is_taken_and_noted(old, tmp_path, caplog):
    kept = dict(old)
    with caplog.at_level(logging.WARNING):
        now = FORM.current(old, tmp_path / "b.json")
    assert now == {"words": ["a"], "count": 1, SCHEMA_VERSION: 3} and old == kept
    notes = [record.message for record in caplog.records]
    assert len(notes) == 2 and all("an older version wrote it" in note for note in notes)
    assert notes[0].startswith(str(tmp_path / "b.json"))


def test_steps_before_the_file_s_own_version_are_not_taken(tmp_path):
    assert FORM.current({"words": [], SCHEMA_VERSION: 2}, tmp_path)["count"] == 0
    present = {"words": [], "count": 7, SCHEMA_VERSION: 3}
    assert FORM.current(present, tmp_path) is present


def test_what_needs_no_change_stays_as_it_is(tmp_path, caplog):
    """Also its version: digests are of what stands in a file."""
    whole = {"pages": 1}
    form = Form("book", 2, MappingProxyType({1: _longer}))
    assert form.current(whole, tmp_path) is whole and not caplog.records


def test_a_newer_version_is_refused_with_what_to_type(tmp_path):
    file = tmp_path / "b.json"
    with pytest.raises(ConfigError) as caught:
        FORM.current({SCHEMA_VERSION: 4}, file)
    said = str(caught.value)
    assert said.startswith(f"{file}: {SCHEMA_VERSION}: a book of version 4 is newer")
    assert "reads up to 3" in said and said.endswith(UPDATE) and "\n" not in said


@pytest.mark.parametrize("version", [0, -1, "2", 1.0, True, None, [1]])
def test_what_is_no_version_is_refused(version, tmp_path):
    with pytest.raises(ConfigError, match="should be a whole number from 1"):
        FORM.current({SCHEMA_VERSION: version}, tmp_path)
