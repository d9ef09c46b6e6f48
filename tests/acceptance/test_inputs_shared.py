"""What people come with: shared cases of other tools become scenes by one command.

Each holds the traffic that SUMO's own log of the case `poly` has.
"""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.reading import read_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.sumo.fcd import read_trajectories

CASES = Path(__file__).parents[2].parent / "shared" / "data" / "cases"

pytestmark = [
    pytest.mark.skipif(not CASES.is_dir(), reason="the shared cases are not here"),
    pytest.mark.slow,
]

GIVEN = {
    # The command's argument, and how far behind the front what it calls the middle is [m]: two
    # cases call the front so.
    "csv_own": ("csv_own", 2.5),
    "ind": ("ind/00_tracks.csv", 2.5),
    "fzp": ("fzp/run.fzp.gz", 0.0),
    "xodr": ("xodr/map.xodr.gz", 0.0),
}


@pytest.mark.parametrize("name", GIVEN)
def test_a_case_becomes_a_scene(name: str, tmp_path: Path) -> None:
    """Positions within a centimetre of SUMO's, headings within a tenth of a degree."""
    if name == "xodr" and find_spec("sumo") is None and shutil.which("netconvert") is None:
        pytest.skip("needs SUMO")
    own, ahead = GIVEN[name]
    scene = tmp_path / "scene.yaml"
    assert main(["init", str(CASES / own), "-o", str(scene)]) == 0
    _, scenario = read_files(load_job(scene))
    truth = list(read_trajectories([CASES / "poly" / "fcd.xml.gz"]).traces)
    assert len(scenario.traffic.traces) == len(truth)
    for trace in scenario.traffic.traces:
        # Two cases count their ids anew.
        begins = [each for each in truth if each.times[0] == pytest.approx(trace.times[0])]
        place = trace.positions[0, :2]
        sumo = min(begins, key=lambda each: np.linalg.norm(each.positions[0, :2] - place))
        truth.remove(sumo)
        ways = np.column_stack([np.cos(trace.yaws), np.sin(trace.yaws)])
        np.testing.assert_allclose(trace.times, sumo.times, atol=1e-6)
        np.testing.assert_allclose(
            trace.positions[:, :2] - ahead * ways, sumo.positions[:, :2], atol=0.01
        )
        off = np.abs(np.angle(np.exp(1j * (trace.yaws - sumo.yaws))))
        assert off.max() < np.radians(0.1)


def test_buildings_have_their_heights(tmp_path: Path) -> None:
    """SUMO 1.28's attribute, and the parameter of earlier ones."""
    scene = tmp_path / "scene.yaml"
    assert main(["init", str(CASES / "poly"), "-o", str(scene)]) == 0
    _, scenario = read_files(load_job(scene))
    heights = {each.id: float(each.params["height"]) for each in scenario.polygons}
    assert heights == {"tower": 42.0, "low": 6.0}
