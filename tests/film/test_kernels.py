"""Kernels are compiled once: by the first frame of the first process that shows a scene."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from builders import write_scenario

PACKAGE = Path(__file__).parents[2]
SCRIPT = """
import json, sys
import drjit as dr
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.live import OpenShot
from sumo3dviz_pt.pipeline.production import Request, frame_times, prepare, ready_renderer

ready_renderer("llvm")
dr.set_flag(dr.JitFlag.KernelHistory, True)
job, compiled = load_job(sys.argv[1]), []
request = Request("post", "draft", (32, 18), 2)
with OpenShot(prepare(job, request, frame_times(4.0, 4.4, 10), film=True)) as shot:
    for _ in shot.frames():
        found = dr.kernel_history([dr.KernelType.JIT])
        compiled.append(sum(not each["cache_hit"] and not each["cache_disk"] for each in found))
print(json.dumps(compiled))
"""


def compiled_in_a_process(scene, home):
    """Kernels that each of four frames of a film compiles."""
    folders = {"HOME": str(home), "SUMO3DVIZ_PT_CACHE": str(home / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(scene)],
        env={**os.environ, **folders, "PYTHONPATH": str(PACKAGE)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


NIGHT = "{sun: {azimuth: 120, elevation: -20}}"


@pytest.mark.slow
@pytest.mark.parametrize("sky", ["{}", NIGHT], ids=["day", "night"])
def test_nothing_is_compiled_after_the_first_frame_nor_in_a_second_process(sky, tmp_path):
    scene = write_scenario(tmp_path, vehicles=3, signals=True)
    with scene.open("a", encoding="utf-8") as file:
        file.write(f"sky: {sky}\n")
    first, *later = compiled_in_a_process(scene, tmp_path)
    assert first > 2 and later == [0, 0, 0]
    assert compiled_in_a_process(scene, tmp_path) == [0, 0, 0, 0]
