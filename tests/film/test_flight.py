"""A film of a flight between key frames; rides and standing cameras have films elsewhere."""

import json

import numpy as np
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.video import probe

FLIGHT = """  flight:
    mode: cinematic
    keyframes:
      - {time: 4, position: [30, -22, 6], look_at: [5, -3, 0]}
      - {time: 6, position: [20, -26, 8], look_at: [5, -3, 0]}
shots:
  - {camera: flight, from: 4, to: 4.3}
"""


def test_the_camera_flies_while_cars_drive(tmp_path):
    scene = write_scenario(tmp_path, vehicles=6, persons=1, signals=True)
    head, _, tail = scene.read_text(encoding="utf-8").partition("shots:\n")
    scene.write_text(head + FLIGHT + tail.partition("\n")[2], encoding="utf-8")
    film = tmp_path / "flight.mp4"
    order = ["render", scene, "--size", "32x18", "--spp", "1", "-o", film]
    assert main([str(word) for word in order]) == 0
    assert probe(film).frames == 3
    pictures = [read_exr(path)[0] for path in sorted(film.with_suffix(".frames").glob("*.exr"))]
    assert len(pictures) == 3
    assert all(np.isfinite(picture).all() and picture.mean() > 0.0 for picture in pictures)
    account = json.loads(film.with_suffix(".json").read_text(encoding="utf-8"))
    eyes = np.array([frame["camera"]["position"] for frame in account["frames"]])
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    np.testing.assert_allclose(eyes[0], [30.0, -22.0, 6.0], atol=1e-6)
    assert (steps > 0.1).all() and (steps < 1.0).all(), "11 m in two seconds"
