"""Check, init and films say where drawn motion breaks its laws."""

from __future__ import annotations

import logging

import pytest

from sumo3dviz_pt.motion.breaches import Lawfulness, lawfulness, note_breaches
from sumo3dviz_pt.motion.laws import HEADING, MOVING, Breach
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.pipeline.reading import motion_of, read_files
from sumo3dviz_pt.pipeline.scene_file import load_job


def motion(smoother):
    job = load_job(example("crossing"))
    job = job.model_copy(
        update={"motion": job.motion.model_copy(update={"smoother": smoother, "heading": "chord"})}
    )
    return motion_of(job, read_files(job, begin=430.0, end=450.0)[1])


def test_the_default_is_silent():
    found = lawfulness(motion("lane"))
    assert found.looked > 10
    assert found.text == ""
    assert found.as_dict()["breaches"] == {}


def test_the_papers_smoother_is_counted_and_noted(caplog):
    made = motion("paper")
    found = lawfulness(made)
    assert f"{len({each.id for each in found.breaches})} of {found.looked} road users" in found.text
    assert found.breaches[0].id in found.text
    with caplog.at_level(logging.WARNING):
        note_breaches(made, made.smooth(), span=(430.0, 450.0))
        note_breaches(made, made.smooth(), span=(420.0, 420.0))
    assert len(caplog.records) == 1
    assert HEADING in caplog.text


def test_a_film_says_the_same_of_users_who_were_looked_at_before(caplog):
    fresh, looked = motion("paper"), motion("paper")
    found = lawfulness(looked)
    assert 0 < len(looked.lawful) == found.looked - len({each.id for each in found.breaches})
    for made in (fresh, looked):
        note_breaches(made, made.smooth(), span=(430.0, 450.0))
    first, second = (record.getMessage() for record in caplog.records)
    assert first == second


@pytest.mark.parametrize(
    ("law", "value", "said"), [(HEADING, 1.0, "57.3"), (MOVING, 0.2, "0.200 m")]
)
def test_the_first_is_named_with_its_size(law, value, said):
    found = Lawfulness(20, 60, (Breach(law, "car.7", 12.5, value), Breach(law, "b", 13.0, value)))
    assert "2 of 20 road users (of 60 in all) are drawn" in found.text
    assert f"The first is car.7 at 12.5 s, {said}" in found.text
