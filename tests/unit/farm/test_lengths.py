"""How long tasks are: 10 to 60 minutes by the forecast, shorter only where workers would idle."""

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.farm.making import FarmOrder
from sumo3dviz_pt.farm.plan import EngineChoice
from sumo3dviz_pt.pipeline.costs import Stages, Work, stages_of
from sumo3dviz_pt.pipeline.scene_file import quality_preset

CORES = 16
FRAMES = 8000
STAGES = stages_of(quality_preset("study", together=True), size=(1280, 720), frames=250)


def length(minutes=None, *, stages=STAGES, frames=FRAMES, **choice):
    """How long the longest task takes, its start included [min], and its frames."""
    order = FarmOrder(EngineChoice("slurm", threads=CORES, **choice), minutes)
    count = order.longest(stages, frames=frames)
    return (stages.start + count * stages.trace).wall(CORES) / 60, count


@pytest.mark.parametrize("minutes", [10, 20, 60])
def test_a_task_is_as_long_as_asked_for(minutes):
    found, count = length(minutes)
    frame = STAGES.trace.wall(CORES) / 60
    assert minutes - frame < found <= minutes and count > 100


def test_a_task_takes_twenty_minutes_unless_workers_would_idle():
    frame = STAGES.trace.wall(CORES) / 60
    whole = FRAMES * frame
    assert length() == length(20) == length(workers=1) == length(workers=8)
    for workers in (32, 64, 128):  # a share for each
        found, count = length(workers=workers)
        assert whole / workers - 2 * frame < found <= whole / workers
        assert count * workers >= FRAMES * 0.8
    found, _ = length(workers=512)  # the start would be most of it
    assert 2 - 2 * frame < found <= 2


def test_workers_do_not_shorten_what_was_asked_for():
    assert length(60, workers=512) == length(60)


def test_frames_that_take_longer_than_a_task_are_tasks_of_one():
    slow = Stages(Work(20.0), Work(shared=30_000.0 * CORES), Work())
    assert length(10, stages=slow)[1] == length(stages=slow, workers=512)[1] == 1


def test_a_number_of_frames_beats_the_forecast():
    assert FarmOrder(EngineChoice(), 10, 7).longest(STAGES, frames=FRAMES) == 7


@pytest.mark.parametrize("minutes", [0, -1, 24 * 60 + 1])
def test_lengths_that_are_none(minutes):
    with pytest.raises(ConfigError, match="minutes"):
        FarmOrder(EngineChoice(), minutes)
