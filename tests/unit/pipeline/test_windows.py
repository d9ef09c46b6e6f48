"""Where somebody is at a time does not hang on the window that is shown."""

from __future__ import annotations

import numpy as np
import pytest
from damage import write_town

from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.pipeline.reading import motion_of, read_files
from sumo3dviz_pt.pipeline.scene_file import load_job

NAMES = ("positions", "yaws", "pitches", "speeds", "travelled")


def poses(job, begin, end, times):
    """Motion at times of everyone who is there in a window, by key."""
    _, scenario = read_files(job, begin=begin, end=end)
    return {each.key: each.sample(times) for each in motion_of(job, scenario).smooth()}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("smoother", "traffic"),
    [("lane", None), ("lane", {"share": 0.5}), ("hermite", None), ("paper_symmetric", None)],
)
def test_frames_do_not_hang_on_where_a_shot_begins(smoother, traffic):
    job = load_job(example("crossing"))
    motion = job.motion.model_copy(update={"smoother": smoother})
    job = job.model_copy(update={"motion": motion})
    if traffic is not None:
        edit = type(job).model_validate({**job.model_dump(), "traffic": traffic}).traffic
        job = job.model_copy(update={"traffic": edit})
    times = np.linspace(441.0, 444.0, 31)
    short, early, late = (
        poses(job, *window, times) for window in ((441.0, 444.0), (405.0, 444.0), (440.0, 470.0))
    )
    alive = {key for key, motion in short.items() if motion.alive.any()}
    assert len(alive) > 10
    for other in (early, late):
        assert alive == {key for key, motion in other.items() if motion.alive.any()}
        for key in alive:
            for name in NAMES:
                one, two = (getattr(each[key], name) for each in (short, other))
                assert one.tobytes() == two.tobytes(), (key, name)


def test_ids_do_not_hang_on_where_a_shot_begins(tmp_path):
    """An id that comes back later with another type is `#2` in every shot."""
    scene = write_town(tmp_path)
    row = '<vehicle id="{}" x="{}" y="-1.6" angle="90" speed="1" pos="9" lane="w_1" type="{}"/>'
    steps = (
        row.format("other", time - 110.0, "car")
        + (row.format("v", time - 60.0, "car") if time < 9 else "")
        + (row.format("v", time - 99.0, "tram") if time > 60 else "")
        for time in range(80)
    )
    text = "".join(f'<timestep time="{time}">{rows}</timestep>' for time, rows in enumerate(steps))
    (tmp_path / "fcd.xml").write_text(f"<fcd-export>{text}</fcd-export>", encoding="utf-8")
    job = load_job(scene)
    for begin, keys in ((0.0, {"vehicle:v", "vehicle:v#2"}), (61.0, {"vehicle:v#2"})):
        _, scenario = read_files(job, begin=begin, end=79.0)
        found = {each.key: each.type_id for each in motion_of(job, scenario).smooth()}
        assert found.keys() == keys | {"vehicle:other"}
        assert found["vehicle:v#2"] == "tram"
