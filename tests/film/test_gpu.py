"""What a GPU draws is what processors draw; run wherever there is one."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.image.metrics import flip
from sumo3dviz_pt.installation.dependencies import find_driver

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(find_driver().problem), reason=f"no GPU: {find_driver().problem}"),
]

NIGHT, RAIN = {"template": "city_night"}, {"weather.preset": "rain"}
CASES = {
    "day": ("crossing", "corner", 456.0, {}),
    "night": ("crossing", "corner", 456.0, NIGHT),
    "rain": ("crossing", "corner", 456.0, RAIN),
    "rain by night": ("crossing", "corner", 456.0, NIGHT | RAIN),
    "driver": ("ronda", "driver", 465.0, {}),
    "overview": ("ronda", "overview", 490.0, {}),
}
PROGRAM = """
import json, logging, sys
from dataclasses import replace
from pathlib import Path
import numpy as np
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.pipeline.production import Request, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

logging.disable(logging.WARNING)  # our own notes; others' are asked about
scene, camera, time, changes, variant, seeds, out, size, spp = json.loads(sys.argv[1])
asked = Request(camera=camera, quality="standard", size=tuple(size), variant=variant, spp=spp)
production = prepare(load_job(Path(scene), changes), asked, np.array([time]), together=True)
with opened(production) as session:
    frame = production.shot.frame_at(time)
    for number, seed in enumerate(seeds):
        session.settings = replace(session.settings, seed=seed)
        session.by_kernel.use(session.settings)
        layers = {name: np.asarray(one) for name, one in session.samples(frame).layers.items()}
        output = production.job.output
        picture = develop_float(
            layers["radiance"], exposure=production.exposure, tone=output.tone, glare=output.glare
        )
        np.savez(f"{out}{number}.npz", picture=picture, **layers)
"""


def drawn(
    case: str, variant: str, seeds: list[int], out: Path, *, size: tuple[int, int], spp: int
) -> list[dict[str, np.ndarray]]:
    """Draw a case with each seed in a process of its own, which says nothing on standard error."""
    scene, camera, time, changes = CASES[case]
    file = data_root("examples") / scene / "scene.yaml"
    words = json.dumps([str(file), camera, time, changes, variant, seeds, str(out), size, spp])
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, words], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    return [dict(np.load(f"{out}{number}.npz")) for number in range(len(seeds))]


@pytest.mark.parametrize("case", CASES)
def test_a_gpu_draws_what_a_processor_draws(case: str, tmp_path: Path) -> None:
    """Same seed, same picture; to a processor's it is as near as one noise to the same noise."""
    how = {"size": (640, 360), "spp": 64}
    one, again, other = drawn(case, "cuda", [1, 1, 2], tmp_path / "cuda", **how)
    (ours,) = drawn(case, "llvm", [1], tmp_path / "llvm", **how)
    for name, layer in one.items():
        np.testing.assert_array_equal(layer, again[name], err_msg=name)
    assert np.isfinite(one["radiance"]).all()
    assert one["capped"].mean() == pytest.approx(ours["capped"].mean(), rel=5e-4)
    assert (one["ids"] != ours["ids"]).mean() < 1e-4
    assert ours["ids"].any()
    close = flip(one["picture"], ours["picture"])
    assert close < 0.01 < flip(one["picture"], other["picture"])
