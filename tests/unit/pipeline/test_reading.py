"""A simulation's files are read once for all shots with one window."""

import os

import pytest
from builders import write_scenario

from sumo3dviz_pt.pipeline import reading
from sumo3dviz_pt.pipeline.reading import read_files, stamps_of
from sumo3dviz_pt.pipeline.scene_file import load_job


@pytest.fixture
def job(tmp_path):
    reading._read_once.cache_clear()
    return load_job(write_scenario(tmp_path, vehicles=3))


def test_shots_with_one_window_share_what_was_read(job):
    _, first = read_files(job, begin=5.0, end=6.0)
    _, again = read_files(job, begin=5.0, end=6.0)
    _, later = read_files(job, begin=5.0, end=7.0)
    assert again is first
    assert later is not first


@pytest.mark.parametrize("which", ["network", "trajectories"])
def test_a_file_that_has_changed_is_read_again(job, which):
    files, first = read_files(job, begin=5.0, end=6.0)
    path = files.network if which == "network" else files.trajectories[0]
    stat = path.stat()
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns + 1_000_000_000))
    _, again = read_files(job, begin=5.0, end=6.0)
    assert again is not first
    assert len(again.traffic.traces) == len(first.traffic.traces)


def test_another_understanding_of_the_files_is_read_anew(job):
    _, first = read_files(job, begin=5.0, end=6.0)
    vehicles = job.vehicles.model_copy(update={"types": {"*": "bus"}})
    _, again = read_files(job.model_copy(update={"vehicles": vehicles}), begin=5.0, end=6.0)
    assert again is not first


def test_files_that_are_missing_have_no_stamp(tmp_path):
    there = tmp_path / "there"
    there.write_text("x", encoding="utf-8")
    assert [stamp[2] for stamp in stamps_of([tmp_path / "gone", there])] == [1]
