"""The shots of a report share trajectories, which are those that each would make by itself."""

import numpy as np
import pytest

from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.pipeline.reading import motion_of, read_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.traffic import Survey
from sumo3dviz_pt.world.outlook import Outlook

BEGIN, END = 452.0, 460.0


@pytest.fixture(scope="module")
def job():
    return load_job(example("crossing"))


@pytest.fixture(scope="module")
def whole(job):
    return motion_of(job, read_files(job)[1])


@pytest.fixture(scope="module")
def part(job):
    return read_files(job, begin=BEGIN, end=END)[1]


def test_a_shot_has_what_the_whole_log_made_and_makes_the_same_alone(job, whole, part):
    shared = motion_of(job, part, Survey(Outlook(), whole))
    assert 0 < len(shared.log.traces) < len(whole.log.traces)
    some = np.arange(len(shared.log.traces)) % 3 == 0
    given, alone = shared.smooth(some), motion_of(job, part).smooth(some)
    assert len(whole.made) == some.sum(), "the whole log's motion keeps it for the next shot"
    again = motion_of(job, part, Survey(Outlook(), whole)).smooth(some)
    times = np.linspace(BEGIN, END, 33)
    for one, other, third in zip(given, alone, again, strict=True):
        assert (one.key, one.type_id) == (other.key, other.type_id)
        assert one.pieces is third.pieces
        ours, theirs = one.sample(times), other.sample(times)
        for name in ("alive", "positions", "yaws", "speeds"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))


def test_another_smoother_shares_nothing(job, whole, part):
    other = job.model_copy(update={"motion": job.motion.model_copy(update={"smoother": "linear"})})
    survey = Survey(Outlook(), whole)
    assert motion_of(other, part, survey).made is not whole.made
    assert motion_of(job, part, survey).made is whole.made
