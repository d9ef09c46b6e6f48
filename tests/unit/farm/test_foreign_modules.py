"""A farm's folder may come from somebody else: what lies in it is never imported."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from sumo3dviz_pt.farm.engines import LocalRun, write_scripts
from sumo3dviz_pt.farm.plan import EngineChoice, FarmFilm, FarmPlan, FarmTask, write_plan
from sumo3dviz_pt.farm.state import TaskState, read_state
from sumo3dviz_pt.farm.worker import Orders, work


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FarmPlan:
    """A farm of one small task, in a folder with modules that are called as ones that we import."""
    for name in ("yaml", "numpy", "sumo3dviz_pt"):
        (tmp_path / f"{name}.py").write_text(
            "from pathlib import Path; (Path(__file__).parent / 'ran').touch()\n", encoding="utf-8"
        )
    task = FarmTask(("completion", "bash"), None, None)
    films, engine = (FarmFilm("a.mp4", 1),), EngineChoice("local", workers=1)
    made = FarmPlan(tmp_path / "farm", (task,), films, engine, "..")
    write_plan(made)
    monkeypatch.chdir(tmp_path)
    return made


def test_tasks_import_nothing_from_where_they_run(plan: FarmPlan) -> None:
    state = work(plan, Orders(), tell=lambda _: None)
    assert not Path("ran").exists()
    assert list(state.states) == [TaskState.DONE]


def test_workers_import_nothing_from_where_they_are_started(plan: FarmPlan) -> None:
    with LocalRun(plan) as run:
        run.tend(read_state(plan))
    assert not Path("ran").exists()
    assert list(read_state(plan).states) == [TaskState.DONE]


@pytest.mark.skipif(shutil.which("sh") is None, reason="there is no shell here")
def test_batch_jobs_import_nothing_from_where_they_are_submitted(plan: FarmPlan) -> None:
    script = write_scripts(plan).parent / "rest.sbatch"
    subprocess.run(["sh", str(script)], check=True)
    assert not Path("ran").exists()
    assert list(read_state(plan).states) == [TaskState.DONE]
