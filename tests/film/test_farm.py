"""Farms: a film in four chunks on this machine, on a Dask cluster and on Slurm, with mishaps.

A worker is killed amid a frame, a frame fails twice, and another fails whatever is done; after
all that the bytes are those of one plain command.
"""

from __future__ import annotations

import filecmp
import io
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, chdir, contextmanager, redirect_stdout, suppress
from pathlib import Path
from threading import Thread

import pytest
from builders import write_scenario
from needed import package
from one_slurm import slurm

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.farm.plan import read_plan
from sumo3dviz_pt.farm.state import Outcome, TaskState, read_state

pytestmark = pytest.mark.slow

PROGRAM = [sys.executable, "-m", "sumo3dviz_pt.cli"]
FILM = ["scene.yaml", "--camera", "post", "--from", "4", "--to", "6.4", "--fps", "10"]
FILM += ["--spp", "40", "--size", "32x18", "--variant", "scalar"]
"""24 frames; nothing is compiled, and each takes long enough to be killed in it."""

FLAKY, POISON, KILLED = 2, 13, 3
"""A frame that fails twice, one that always fails, and the task whose worker is killed."""

PATIENCE = 240.0
"""A farm takes less [s]."""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A scene, and its film by a plain command."""
    folder = tmp_path_factory.mktemp("farm")
    write_scenario(folder, vehicles=2)
    run(folder, "render", *FILM, "-o", "plain.mp4")
    return folder


def run(folder, *words, code=0, env=None):
    """Run a command to its end; what it printed."""
    done = subprocess.run(
        [*PROGRAM, *words], cwd=folder, capture_output=True, text=True, check=False, env=env
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


def status(folder, name):
    said = io.StringIO()
    with chdir(folder), redirect_stdout(said):
        assert main(["farm", "status", name, "--json"]) == 0
    return json.loads(said.getvalue())


def failures(state, frame):
    """Tries that ended at a frame."""
    return [
        one
        for tries in state.tries.values()
        for one in tries
        if one.end is not None and one.end.frame == frame and one.end.outcome is not Outcome.STOPPED
    ]


def mishaps(folder, name, process):
    """Make things go wrong while a farm works; returns what status said meanwhile."""
    stem = name.removesuffix(".mp4")
    frames, farm = folder / f"{stem}.frames", folder / f"{stem}.farm"
    until, killed, seen = time.monotonic() + PATIENCE, None, []
    while not (farm / "plan.json").exists():
        assert process.poll() is None and time.monotonic() < until
        time.sleep(0.02)
    plan = read_plan(farm)
    for number in (FLAKY, POISON):  # where a folder lies, no frame can be stored
        (frames / f"{number:06d}.exr").mkdir(parents=True)
    Thread(target=mend, args=(plan, frames, process), daemon=True).start()
    seen.append(right_status(folder, name))
    while process.poll() is None:
        assert time.monotonic() < until, (farm, read_state(plan).states)
        state = read_state(plan)
        if len(seen) == 1 and TaskState.RUNNING in state.states:
            seen.append(right_status(folder, name))
        if killed is None and kill_amid_a_frame(frames, state):
            killed = time.time()
            seen.append(right_status(folder, name))
        time.sleep(0.05)
    assert killed is not None
    # The frame that the dead worker's command was at was stored after its death.
    stored = [(frames / f"{n:06d}.exr").stat().st_mtime for n in range(6 * KILLED, 6 * KILLED + 6)]
    assert min(stored) < killed < max(stored)
    return seen


def mend(plan, frames, process):
    """Let a frame be stored that failed twice, beside whatever is looked at meanwhile."""
    broken = frames / f"{FLAKY:06d}.exr"
    while process.poll() is None and broken.is_dir():
        if len(failures(read_state(plan), FLAKY)) == 2:
            broken.rmdir()
        time.sleep(0.02)


def right_status(folder, name):
    """What `farm status` says, held against the disk before and after."""
    plan = read_plan(folder / f"{name.removesuffix('.mp4')}.farm")
    before = read_state(plan).frames[0]
    found = status(folder, name)
    assert before <= found["frames"]["done"] <= read_state(plan).frames[0]
    assert found["frames"]["total"] == 24 and sum(found["tasks"].values()) == 5
    assert (found["state"] == "working") == bool(found["workers"])
    assert found["tasks"].get("running", 0) == len(found["workers"])
    assert all(one["pid"] > 0 and 0 <= one["task"] < 5 for one in found["workers"])
    return found


def kill_amid_a_frame(frames, state):
    """Kill the worker of a task while its command renders a frame; whether that could be done.

    The command stands still meanwhile, with frames before and after, and none half written.
    """
    plan, last = state.plan, state.last(KILLED)
    if state.states[KILLED] is not TaskState.RUNNING or not 0 < len(state.missing(KILLED)) < 6:
        return False
    (command,) = children(last.pid) or (None,)
    if command is None:
        return False
    os.kill(command, signal.SIGSTOP)
    try:
        now = read_state(plan)
        amid = 0 < len(now.missing(KILLED)) < 6 and not list(frames.glob("*.part"))
        same = now.last(KILLED).pid == last.pid and now.last(KILLED).end is None
        if amid and same:
            os.kill(last.pid, signal.SIGKILL)
        return amid and same
    finally:
        os.kill(command, signal.SIGCONT)


def children(pid):
    """Processes that one has begun."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            after_name = path.read_text("utf-8", "replace").rpartition(")")[2].split()
            if int(after_name[1]) == pid and after_name[0] != "Z":
                found.append(int(path.parent.name))
    return found


def check_end(folder, name, process, seen):
    """The poison frame is named; when it is mended, the film is that of a plain command."""
    stem = name.removesuffix(".mp4")
    assert process.returncode == 1
    begin, working, after = seen
    assert begin["state"] in ("working", "waiting") and begin["frames"]["done"] < 24
    assert working["state"] == "working" and working["workers"]
    assert after["state"] in ("working", "waiting") and 0 < after["frames"]["done"] < 24
    found = status(folder, name)
    assert found["state"] == "failed" and found["frames"] == {"done": 23, "total": 24}
    assert found["set_aside"] == {name: [POISON]}
    assert found["tasks"] == {"done": 3, "incomplete": 1, "blocked": 1}
    assert f"1 frame ({POISON})" in found["problems"][0]
    assert not (folder / name).exists()
    state = read_state(read_plan(folder / f"{stem}.farm"))
    assert len(failures(state, FLAKY)) == 2 and len(failures(state, POISON)) == 3
    assert Outcome.LOST in {one.end.outcome for one in state.tries[KILLED]}
    (folder / f"{stem}.frames" / f"{POISON:06d}.exr").rmdir()


def check_same(folder, name):
    """Every frame and the film have the bytes of the plain command's."""
    stem = name.removesuffix(".mp4")
    found = status(folder, name)
    assert found["state"] == "done" and found["frames"] == {"done": 24, "total": 24}
    names = sorted(path.name for path in (folder / "plain.frames").iterdir())
    assert names == sorted(path.name for path in (folder / f"{stem}.frames").iterdir())
    _, *other = filecmp.cmpfiles(folder / "plain.frames", folder / f"{stem}.frames", names, False)
    assert other == [[], []]
    assert (folder / name).read_bytes() == (folder / "plain.mp4").read_bytes()


def farm(folder, name, *words, env=None):
    """Run a farm among mishaps, mend what is broken, and go on."""
    words = ["farm", *FILM, "--task-frames", "6", "--lease", "20", *words, "-o", name]
    with (folder / f"{name}.txt").open("wb") as log:
        process = subprocess.Popen(
            [*PROGRAM, *words], cwd=folder, env=env, stdout=log, stderr=subprocess.STDOUT
        )
        try:
            seen = mishaps(folder, name, process)
        finally:
            process.terminate()
            process.wait()
    check_end(folder, name, process, seen)
    run(folder, "farm", "resume", name, env=env)
    check_same(folder, name)


def test_a_farm_of_this_machine(place):
    farm(place, "local.mp4", "--workers", "2")
    said = (place / "local.mp4.txt").read_text("utf-8")
    assert "about" in said and f"set aside after 3 tries: 1 frame ({POISON})" in said
    assert main(["farm", "status", str(place / "nothing.mp4")]) == 2


@contextmanager
def dask_cluster(folder):
    """A scheduler and two workers on loopback, each a process; gives the scheduler's file."""
    known = folder / "scheduler.json"
    common = ["--no-dashboard", "--scheduler-file", str(known)]
    scheduler = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    worker = ["distributed.cli.dask_worker", "--nworkers", "2", "--nthreads", "1"]
    worker += ["--local-directory", str(folder / "dask")]
    with ExitStack() as stack:
        log = stack.enter_context((folder / "dask.txt").open("wb"))
        for words in (scheduler, worker):
            process = subprocess.Popen(
                [sys.executable, "-m", *words, *common], stdout=log, stderr=log, cwd=folder
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
            while not known.exists():
                assert process.poll() is None, (folder / "dask.txt").read_text("utf-8")
                time.sleep(0.1)
        yield known


def test_a_farm_of_dask(place):
    package("distributed")
    with dask_cluster(place) as scheduler:
        farm(place, "dask.mp4", "--engine", "dask", "--scheduler", str(scheduler))
        address = json.loads(scheduler.read_text("utf-8"))["address"]
        assert address.startswith("tcp://127.0.0.1:")
        words = ("--task-frames", "12", "--engine", "dask", "--scheduler", address)
        run(place, "farm", *FILM, *words, "-o", "address.mp4")
        check_same(place, "address.mp4")


def test_a_farm_of_dask_makes_a_cluster_of_its_own(place):
    package("distributed")
    words = ("--task-frames", "12", "--engine", "dask", "--workers", "2")
    said = run(place, "farm", *FILM, *words, "-o", "cluster.mp4")
    assert "2 Dask workers of tcp://127.0.0.1:" in said and "wrote cluster.mp4: 24 frames" in said
    check_same(place, "cluster.mp4")


def test_a_farm_of_slurm(place, tmp_path):
    with slurm(tmp_path) as env:
        words = ("--engine", "slurm", "--cpus-per-task", "1", "--time", "0:30:00")
        farm(place, "slurm.mp4", *words, env=env)
        detach(place, env)
    scripts = place / "slurm.farm" / "slurm"
    assert "--array=0-3" in (scripts / "frames.sbatch").read_text("utf-8")


def detach(place, env):
    """Jobs are submitted and left; at a stop those that wait are taken back."""
    words = ("--engine", "slurm", "--cpus-per-task", "2", "--time", "0:30:00", "--detach")
    said = run(place, "farm", *FILM, "--task-frames", "6", *words, "-o", "left.mp4", env=env)
    assert "0 of 24 frames are there: sumo3dviz-pt farm status left.mp4" in said
    assert status(place, "left.mp4")["state"] in ("waiting", "working")
    until, frames = time.monotonic() + PATIENCE, place / "left.frames"
    while len(list(frames.glob("*.exr"))) < 2:
        assert time.monotonic() < until
        time.sleep(0.1)
    assert "PENDING" in jobs_of(env)
    run(place, "farm", "stop", "left.mp4", env=env)
    while jobs_of(env):  # the one that runs finishes its frame; nobody else begins
        assert time.monotonic() < until and "PENDING" not in jobs_of(env)
        time.sleep(0.5)
    found = status(place, "left.mp4")
    assert found["state"] == "stopped" and 2 <= found["frames"]["done"] <= 6


def jobs_of(env):
    """States of all jobs that Slurm has."""
    words = ["squeue", "--noheader", "--format=%T", "--states=PENDING,RUNNING,COMPLETING"]
    done = subprocess.run(words, env=env, capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_without_slurm_the_scripts_are_written_and_the_command_is_named(place, monkeypatch):
    env = {**os.environ, "PATH": os.path.dirname(sys.executable)}  # noqa: PTH120
    said = run(place, "farm", *FILM, "--engine", "slurm", "-o", "later.mp4", env=env)
    assert "Slurm is not here; where it is, run: sh " in said
    assert status(place, "later.mp4")["state"] == "waiting"
    script = (place / "later.farm" / "slurm" / "frames.sbatch").read_text("utf-8")
    for line in ("--requeue", "--open-mode=append", "--cpus-per-task=16", "--signal=B:TERM@120"):
        assert f"#SBATCH {line}\n" in script


def test_a_stopped_farm_loses_no_frame_and_goes_on(place):
    words = ["farm", *FILM, "--task-frames", "24", "-o", "stop.mp4"]
    with (place / "stop.txt").open("wb") as log:
        process = subprocess.Popen(
            [*PROGRAM, *words], cwd=place, stdout=log, stderr=subprocess.STDOUT
        )
        frames = place / "stop.frames"
        while len(list(frames.glob("*.exr"))) < 3 and process.poll() is None:
            time.sleep(0.05)
        run(place, "farm", "stop", "stop.mp4")
        assert process.wait(60) == 130
    found = status(place, "stop.mp4")
    assert found["state"] == "stopped" and 3 <= found["frames"]["done"] < 24
    assert not found["problems"] and not list(frames.glob("*.part"))
    run(place, *words, code=2)  # nothing is overwritten unasked
    run(place, "farm", "resume", "stop.mp4")
    check_same(place, "stop.mp4")


def test_a_frame_is_finished_when_the_process_is_asked_to_end(place):
    words = ["render", *FILM, "-o", "term.mp4"]
    process = subprocess.Popen(
        [*PROGRAM, *words], cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    frames = place / "term.frames"
    while len(list(frames.glob("*.exr"))) < 2 and process.poll() is None:
        time.sleep(0.02)
    process.terminate()
    said = process.communicate()[1].decode()
    assert process.returncode == 130 and "--resume goes on" in said
    assert not list(frames.glob("*.part"))
    run(place, *words, "--resume")
    assert (place / "term.mp4").read_bytes() == (place / "plain.mp4").read_bytes()


def test_several_shots_are_several_films(place):
    text = (place / "scene.yaml").read_text("utf-8")
    text = text.replace(
        "from: 4, to: 5}", "from: 4, to: 4.2}\n  - {camera: post, from: 5, to: 5.3}"
    )
    (place / "two.yaml").write_text(text, encoding="utf-8")
    words = ["two.yaml", "--spp", "1", "--size", "32x18", "--variant", "scalar"]
    run(place, "farm", *words, "-o", "farm_{shot}.mp4")
    run(place, "render", *words, "-o", "own_{shot}.mp4")
    for shot in ("1_post", "2_post"):
        names = sorted(path.name for path in (place / f"own_{shot}.frames").iterdir())
        pair = (place / f"own_{shot}.frames", place / f"farm_{shot}.frames")
        assert filecmp.cmpfiles(*pair, names, False)[1:] == ([], [])
        assert len(names) == {"1_post": 3, "2_post": 4}[shot]  # with film.json
    assert "done" in run(place, "farm", "status", "farm_{shot}.mp4")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--engine", "slrm"], "did you mean 'slurm'"),
        (["--time-budget", "3"], "on every machine a pilot would choose other samples"),
        (["--task-minutes", "0"], "minutes"),
        (["--scheduler", "a b", "--engine", "dask"], "one word"),
        (["-o", "plain.mp4"], "plain.json exists already"),
    ],
)
def test_what_is_wrong_is_one_sentence(place, words, said, monkeypatch, capsys):
    monkeypatch.chdir(place)
    assert main(["farm", *FILM[:-6], "-o", "wrong.mp4", *words]) == 2
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1 and said in told[0]
    assert not (place / "wrong.farm").exists()


STUDY = """scene: scene.yaml
clip: {camera: post, from: 2, to: 2.4}
common: {quality: draft, output.size: [32, 18]}
factors:
  light: {levels: {clear: {sky: {preset: sky_blue}}, grey: {sky: {preset: sky_overcast}}}}
certificate: {write: false}
report: {write: false}
"""


def test_a_study_of_a_farm_is_that_of_one_command(place):
    (place / "study.yaml").write_text(STUDY, encoding="utf-8")
    words = ["study.yaml", "--variant", "scalar"]
    run(place, "study", *words, "-o", "own")
    run(place, "farm", *words, "--task-frames", "4", "-o", "farmed")
    found = status(place, "farmed")
    assert found["state"] == "done" and found["tasks"] == {"done": 5}
    own = sorted(p.relative_to(place / "own") for p in (place / "own").rglob("*") if p.is_file())
    names = [str(name) for name in own if not str(name).startswith("checksums")]
    assert len(names) > 15
    assert filecmp.cmpfiles(place / "own", place / "farmed", names, False)[1:] == ([], [])
    assert not (place / "farmed" / "study.films").exists()
    with chdir(place):
        assert main(["study", *words, "--film", "nobody", "-o", "other"]) == 2
        assert main(["study", *words, "--frames", "0:1", "-o", "other"]) == 2
    assert not (place / "other").exists()
