"""Tasks, tries and what becomes of them, by files on disk alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.farm.plan import (
    PLAN,
    EngineChoice,
    FarmFilm,
    FarmPlan,
    FarmTask,
    chunks,
    farm_folder,
    read_plan,
    write_plan,
)
from sumo3dviz_pt.farm.run import check_engine, renew, status_of, stop_farm
from sumo3dviz_pt.farm.state import (
    OVER,
    End,
    Outcome,
    TaskState,
    beat,
    finish,
    read_state,
    take,
    this_host,
    tries_in,
)
from sumo3dviz_pt.farm.worker import Orders, parts, work


@pytest.fixture
def plan(tmp_path):
    """Two chunks of four frames, and the film."""
    tasks = [
        FarmTask(("render", "--frames", "0:4"), 0, (0, 4), (), 40.0),
        FarmTask(("render", "--frames", "4:8"), 0, (4, 8), (), 40.0),
        FarmTask(("render",), 0, None, (0, 1), 20.0),
    ]
    films = (FarmFilm("a.mp4", 8),)
    made = FarmPlan(tmp_path / "a.farm", tuple(tasks), films, EngineChoice(), "..", lease=60.0)
    write_plan(made)
    return made


def store(plan, *numbers):
    folder = plan.place / plan.films[0].folder
    folder.mkdir(exist_ok=True)
    for number in numbers:
        (folder / f"{number:06d}.exr").touch()


def ended(plan, task, outcome, **more):
    """One more try of a task that has ended."""
    number = len(tries_in(plan.folder).get(task, ())) + 1
    own = take(plan.folder, task, number)
    assert own is not None
    assert finish(plan.folder, own, End(outcome, **more))


def states(plan, **more):
    return list(map(str, read_state(plan, **more).states))


@given(st.integers(1, 5000), st.integers(1, 6000))
def test_chunks_cover_a_film_once_and_are_alike(frames, longest):
    found = chunks(frames, longest=longest)
    assert [n for first, after in found for n in range(first, after)] == list(range(frames))
    lengths = [after - first for first, after in found]
    assert max(lengths) <= longest and max(lengths) - min(lengths) <= 1


@given(
    st.integers(0, 20),
    st.integers(1, 20),
    st.frozensets(st.integers(0, 40)),
    st.sets(st.integers(0, 40)),
)
def test_stretches_hold_all_that_is_missing_and_nothing_that_is_set_aside(
    first, count, aside, missing
):
    frames = range(first, first + count)
    aside = aside & frozenset(frames)
    missing = sorted((missing & set(frames)) - aside)
    found = [n for part in parts((first, first + count), aside, missing) for n in range(*part)]
    assert not set(found) & aside and set(missing) <= set(found) <= set(frames)
    assert sorted(set(found)) == found


def test_a_plan_is_read_as_it_was_written(plan):
    assert read_plan(plan.folder) == plan
    assert plan.place == plan.folder.parent.resolve()
    assert plan.tasks[0].line((1, 3)) == ["render", "--frames", "1:3"]


def test_plans_that_are_no_plans_are_refused(plan):
    (plan.folder / PLAN).write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="damaged"):
        read_plan(plan.folder)
    (plan.folder / PLAN).write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="damaged"):
        read_plan(plan.folder)
    with pytest.raises(ConfigError, match="there is no farm"):
        read_plan(plan.folder / "other")


@pytest.mark.parametrize(
    ("output", "folder"),
    [
        ("x/film.mp4", "x/film.farm"),
        ("x/film_{shot}.mp4", "x/film_shots.farm"),
        ("film_{frame}.png", "film.farm"),
        ("film.farm", "film.farm"),
        ("study", "study/farm"),
        ("study/farm", "study/farm"),
    ],
)
def test_a_farm_lies_beside_what_comes_out(output, folder):
    assert farm_folder(Path(output)) == Path(folder)


def test_only_one_of_many_workers_gets_a_try(plan):
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: take(plan.folder, 0, 1), range(64)))
    assert sum(one is not None for one in found) == 1


def test_only_the_first_end_of_a_try_counts(plan):
    own = take(plan.folder, 0, 1)
    assert finish(plan.folder, own, End(Outcome.DONE))
    assert not finish(plan.folder, own, End(Outcome.LOST))
    assert tries_in(plan.folder)[0][0].end.outcome is Outcome.DONE


def test_a_task_is_somebodys_while_signs_of_life_come(plan):
    own = take(plan.folder, 0, 1)
    now = time.time()
    assert states(plan, now=now) == ["running", "ready", "waiting"]
    path = next((plan.folder / "tries").glob("000000.001.json"))
    os.utime(path, (now - 61, now - 61))
    assert states(plan, now=now) == ["ready", "ready", "waiting"]
    beat(plan.folder, own)
    assert states(plan) == ["running", "ready", "waiting"]


def test_a_dead_process_of_this_machine_holds_nothing(plan):
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    folder = plan.folder / "tries"
    folder.mkdir()
    content = {"host": this_host(), "pid": process.pid, "began": time.time()}
    (folder / "000000.001.json").write_text(json.dumps(content), encoding="utf-8")
    assert states(plan)[0] == "ready"
    content["host"] = "elsewhere"
    (folder / "000000.001.json").write_text(json.dumps(content), encoding="utf-8")
    assert states(plan)[0] == "running"


def test_a_try_that_is_being_written_is_somebodys(plan):
    (plan.folder / "tries").mkdir()
    (plan.folder / "tries" / "000000.001.json").touch()
    assert states(plan)[0] == "running"


def test_a_task_is_done_when_its_frames_are_there(plan):
    ended(plan, 0, Outcome.DONE)
    assert states(plan) == ["ready", "ready", "waiting"]
    store(plan, 0, 1, 2, 3)
    assert states(plan) == ["done", "ready", "waiting"]
    ended(plan, 1, Outcome.DONE)
    store(plan, 4, 5, 6, 7)
    assert states(plan) == ["done", "done", "ready"]
    (plan.place / "a.frames" / "000002.exr").unlink()
    assert states(plan) == ["ready", "done", "waiting"]
    store(plan, 2)
    ended(plan, 2, Outcome.DONE)
    assert read_state(plan).complete
    for path in (plan.place / "a.frames").glob("*.exr"):
        path.unlink()  # --discard-frames
    assert read_state(plan).complete


def test_a_frame_is_set_aside_after_three_tries_and_the_rest_goes_on(plan):
    store(plan, 0)
    for left in (2, 1, 0):
        assert read_state(plan).aside[0] == frozenset()
        ended(plan, 0, Outcome.LOST if left else Outcome.FAILED, frame=1, said="no sun")
    state = read_state(plan)
    assert state.aside[0] == {1} and state.missing(0) == [2, 3]
    assert states(plan) == ["ready", "ready", "waiting"]
    store(plan, 2, 3, *range(4, 8))
    ended(plan, 0, Outcome.ASIDE, stored=2)
    ended(plan, 1, Outcome.DONE)
    state = read_state(plan)
    assert states(plan) == ["incomplete", "done", "blocked"]
    assert state.over and not state.complete
    status = status_of(state)
    assert status.word == "failed"
    assert "1 frame (1): no sun" in str(status) and status.as_dict()["set_aside"] == {"a.mp4": [1]}
    assert renew(plan) == 1
    assert states(plan) == ["ready", "done", "waiting"]
    assert read_state(plan).aside[0] == frozenset()


def test_stops_and_progress_do_not_count_against_a_frame(plan):
    for _ in range(5):
        ended(plan, 0, Outcome.STOPPED)
        ended(plan, 2, Outcome.STOPPED)
    assert states(plan) == ["ready", "ready", "waiting"]


def test_many_frames_that_fail_in_a_row_are_no_accident(plan):
    for frame in (0, 1, 2):
        for _ in range(3):
            ended(plan, 0, Outcome.FAILED, frame=frame, said="no renderer")
    assert states(plan) == ["failed", "ready", "blocked"]
    assert "task 0 failed: no renderer" in str(status_of(read_state(plan)))


def test_what_a_command_refuses_is_not_tried_again(plan):
    ended(plan, 1, Outcome.REFUSED, said="camera: unknown")
    assert states(plan) == ["ready", "failed", "blocked"]


def test_a_film_that_cannot_be_made_fails_after_three_tries(plan):
    store(plan, *range(8))
    ended(plan, 0, Outcome.DONE)
    ended(plan, 1, Outcome.DONE)
    for _ in range(3):
        assert states(plan)[2] == "ready"
        ended(plan, 2, Outcome.FAILED, said="disk full")
    assert states(plan)[2] == "failed"


@given(
    st.lists(
        st.tuples(
            st.integers(0, 2),
            st.sampled_from(list(Outcome)),
            st.none() | st.integers(0, 7),
            st.integers(0, 4),
        ),
        max_size=12,
    ),
    st.frozensets(st.integers(0, 7)),
)
@example([(1, Outcome.DONE, None, 0), (1, Outcome.ASIDE, None, 0)], frozenset())
def test_every_history_has_a_state_and_a_status(tmp_path_factory, history, present):
    """Nothing on disk is contradictory enough to stop anybody; a farm that is over has a reason."""
    folder = tmp_path_factory.mktemp("farm")
    chunk = FarmTask(("render", "--frames", "0:8"), 0, (0, 8), (), 10.0)
    tasks = (chunk, FarmTask(("render",), 0, None, (0,)), FarmTask(("study",), None, None, (1,)))
    plan = FarmPlan(folder / "f", tasks, (FarmFilm("a.mp4", 8),), EngineChoice(), "..")
    write_plan(plan)
    store(plan, *present)
    for task, outcome, frame, stored in history:
        ended(plan, task, outcome, frame=frame if task == 0 else None, stored=stored)
    state = read_state(plan)
    status = status_of(state)
    assert json.dumps(status.as_dict()) and str(status)
    if state.over and not state.complete:
        assert any(s in (TaskState.FAILED, TaskState.ASIDE) for s in state.states)
    if not state.over:
        assert any(s not in OVER and s is not TaskState.WAITING for s in state.states)
    renew(plan)
    assert TaskState.BLOCKED not in read_state(plan).states


def test_status_tells_pace_and_time_left(plan):
    status = status_of(read_state(plan))
    assert status.word == "waiting" and status.left is None and status.pace is None
    own = take(plan.folder, 0, 1)
    now = own.began
    status = status_of(read_state(plan, now=now), now=now)
    assert status.word == "working" and status.left == 100.0  # the forecast, one worker
    store(plan, 0, 1)
    status = status_of(read_state(plan, now=now + 20), now=now + 20)
    assert status.pace == pytest.approx(360, rel=0.05)
    assert status.left == pytest.approx(80, rel=0.05)  # 20 of 100 CPU-s took 20 s
    stop_farm(plan)
    assert status_of(read_state(plan)).word == "stopping"
    finish(plan.folder, own, End(Outcome.STOPPED))
    assert status_of(read_state(plan)).word == "stopped"


def test_status_before_anybody_came_and_with_workers(plan):
    found = status_of(read_state(plan)).as_dict()
    assert (found["state"], found["frames"]) == ("waiting", {"done": 0, "total": 8})
    assert found["tasks"] == {"ready": 2, "waiting": 1}
    assert found["workers"] == [] and found["frames_per_hour"] is None
    assert found["seconds_left"] is None and found["problems"] == []
    own = take(plan.folder, 1, 1)
    store(plan, 4, 5)
    status = status_of(read_state(plan), now=own.began + 90)
    found = status.as_dict()
    assert (found["state"], found["frames"]) == ("working", {"done": 2, "total": 8})
    assert found["tasks"] == {"running": 1, "ready": 1, "waiting": 1}
    host, pid = this_host(), os.getpid()
    assert found["workers"] == [{"task": 1, "try": 1, "host": host, "pid": pid}]
    assert f"  worker    {host.split()[0]}, task 1, for 2 min" in str(status)


def test_nobody_begins_anything_after_a_stop(plan):
    stop_farm(plan)
    state = work(plan, Orders(), tell=pytest.fail)
    assert state.stopping and not state.tries


def test_a_task_that_waits_for_others_is_left(plan):
    state = work(plan, Orders(), only=2, tell=pytest.fail)
    assert not state.over


def test_engines_that_do_not_exist_are_refused():
    with pytest.raises(ConfigError, match="did you mean 'slurm'"):
        check_engine(EngineChoice("slrm"))
    with pytest.raises(ConfigError, match="one word"):
        EngineChoice("slurm", partition="long; rm")
    assert check_engine(EngineChoice("local", workers=4096)).threads == 1


@pytest.mark.skipif(os.name == "nt", reason="temporary folders are one's own there")
@pytest.mark.parametrize("how", ["open", "link"])
def test_kernels_of_others_are_not_run(plan, tmp_path, monkeypatch, how):
    """Compiled kernels in the temporary folder are code; nobody else may have laid them there."""
    monkeypatch.delenv("DRJIT_CACHE_DIR", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder = tmp_path / f"sumo3dviz-pt-kernels-{os.getuid()}"
    if how == "link":
        folder.symlink_to(tmp_path)
    else:
        folder.mkdir()
        folder.chmod(0o777)
    spread = replace(plan, engine=EngineChoice("dask"))
    with pytest.raises(ConfigError, match="DRJIT_CACHE_DIR name a folder of your own"):
        work(spread, Orders(), tell=print)
    assert not tries_in(plan.folder)


@pytest.mark.parametrize("name", ["\ud800", "a\0b", "", "."])
def test_a_plan_names_files_that_can_be(plan, name):
    path = plan.folder / PLAN
    content = json.loads(path.read_bytes())
    content["films"][0]["path"] = name
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match="plan is damaged"):
        read_plan(plan.folder)
