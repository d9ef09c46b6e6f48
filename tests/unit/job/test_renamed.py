"""Former names of keys are understood wherever they may stand, and the present one is told."""

import logging

import pytest

from sumo3dviz_pt.job.renamed import RENAMED, with_present_names
from sumo3dviz_pt.job.settings import Job, default

NAMES = {"picture.width": "across", "cameras.*.angle": "fov", "shots.*.pace": "speed"}

FORMS = {
    "nested": (
        {"picture": {"width": 3}, "cameras": {"a": {"angle": 50}}, "shots": [{"pace": 2}]},
        {"picture": {"across": 3}, "cameras": {"a": {"fov": 50}}, "shots": [{"speed": 2}]},
    ),
    "dotted": (
        {"picture.width": 3, "cameras.a.angle": 50, "shots.0.pace": 2},
        {"picture.across": 3, "cameras.a.fov": 50, "shots.0.speed": 2},
    ),
    "half dotted": ({"cameras.a": {"angle": 50}}, {"cameras.a": {"fov": 50}}),
    "below a renamed key": ({"picture.width.least": 1}, {"picture.across.least": 1}),
    "of the same name elsewhere": ({"width": 1, "output": {"width": 2}}, None),
    "of odd kinds": ({"picture": None, "cameras": [1], "shots": "x", "a.b": 1}, None),
}


@pytest.mark.parametrize("name", FORMS)
def test_former_names_become_present_ones(name, caplog):
    before, after = FORMS[name]
    kept = repr(before)
    with caplog.at_level(logging.WARNING):
        assert with_present_names(before, names=NAMES) == (before if after is None else after)
    assert repr(before) == kept, "what was read stays as it is"
    assert bool(caplog.records) == (after is not None)


def test_the_note_names_both(caplog):
    with_present_names({"picture": {"width": 3}}, names=NAMES)
    (record,) = caplog.records
    assert "the key picture.width of scene files is called picture.across now" in record.message


def test_present_names_exist_and_former_ones_do_not():
    """Of the table of this version."""
    for former, present in RENAMED.items():
        *parents, last = former.replace("*", "NAME").split(".")
        assert parents or last not in Job.model_fields
        if "NAME" not in parents:
            default(".".join([*parents, present]))
