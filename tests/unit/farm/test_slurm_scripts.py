"""Batch scripts: arrays by the tasks' numbers, each job after the one before it."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace

import pytest

from sumo3dviz_pt.farm.engines import write_scripts
from sumo3dviz_pt.farm.plan import EngineChoice, FarmFilm, FarmPlan, FarmTask, write_plan


def study(folder, *, films=3, each=2, **choice):
    """A study of some films, each in some chunks."""
    tasks = [
        FarmTask(
            ("study", "--frames", f"{4 * k}:{4 * k + 4}"), film, (4 * k, 4 * k + 4), (), 3600.0
        )
        for film in range(films)
        for k in range(each)
    ]
    for film in range(films):
        own = tuple(range(film * each, film * each + each))
        tasks.append(FarmTask(("study",), film, None, own, 60.0))
    tasks.append(FarmTask(("study",), None, None, tuple(range(films * each, len(tasks))), 10.0))
    names = tuple(FarmFilm(f"materials/{film}.mp4", 4 * each) for film in range(films))
    plan = FarmPlan(folder / "farm", tuple(tasks), names, EngineChoice("slurm", **choice), "..")
    write_plan(plan)
    return plan


def test_each_array_has_the_numbers_of_its_tasks(tmp_path):
    own = {"partition": "long", "account": "me", "memory": "6G", "gpus": "gpu:a100:1"}
    plan = study(tmp_path, workers=4, threads=8, **own)
    folder = write_scripts(plan).parent
    frames = (folder / "frames.sbatch").read_text("utf-8")
    lines = ("array=0-5%4", "cpus-per-task=8", "partition=long", "account=me", "mem=6G")
    for line in (*lines, "gres=gpu:a100:1"):
        assert f"#SBATCH --{line}\n" in frames
    assert '--task "$SLURM_ARRAY_TASK_ID"' in frames
    assert "#SBATCH --array=6-8%4\n" in (folder / "films.sbatch").read_text("utf-8")
    rest = (folder / "rest.sbatch").read_text("utf-8")
    assert "--array" not in rest and "SLURM_ARRAY_TASK_ID" not in rest


def test_limits_follow_the_forecast_unless_one_is_given(tmp_path):
    plan = study(tmp_path, threads=1)
    text = (write_scripts(plan).parent / "frames.sbatch").read_text("utf-8")
    assert "#SBATCH --time=3:20:00\n" in text  # three times an hour, and twenty minutes
    plan = replace(plan, engine=replace(plan.engine, time="1-0"))
    text = (write_scripts(plan).parent / "frames.sbatch").read_text("utf-8")
    assert "#SBATCH --time=1-0\n" in text


def test_more_tasks_than_slurm_takes_are_worked_at_by_as_many_workers_as_it_takes(tmp_path):
    plan = study(tmp_path, films=1, each=1500)
    text = (write_scripts(plan).parent / "frames.sbatch").read_text("utf-8")
    assert "#SBATCH --array=0-999\n" in text and "--task" not in text.split("exec")[1]


@pytest.mark.skipif(shutil.which("sh") is None, reason="there is no shell here")
def test_jobs_wait_for_those_before_them(tmp_path):
    """The script is run by a real shell; what stands for sbatch notes how it was called."""
    plan = study(tmp_path)
    script = write_scripts(plan)
    (tmp_path / "bin").mkdir()
    sbatch = tmp_path / "bin" / "sbatch"
    calls = tmp_path / "calls"
    sbatch.write_text(f'#!/bin/sh\necho "$@" >>{calls}\necho "1$(wc -l <{calls});one"\n', "utf-8")
    sbatch.chmod(0o755)
    path = f"{sbatch.parent}:/usr/bin:/bin"
    subprocess.run(["sh", str(script)], env={"PATH": path}, check=True)
    called = [line.split() for line in calls.read_text("utf-8").splitlines()]
    assert [line[-1].rpartition("/")[2] for line in called] == [
        "frames.sbatch", "films.sbatch", "rest.sbatch",
    ]  # fmt: skip
    assert [line[1] for line in called[1:]] == [
        "--dependency=afterany:11", "--dependency=afterany:12",
    ]  # fmt: skip
    assert (script.parent / "jobs.txt").read_text("utf-8").split() == ["11", "12", "13"]
