"""Sound tracks beside a film."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.cli import main

pytestmark = pytest.mark.slow


def table(path):
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_a_film_comes_with_a_listener_and_its_sources(tmp_path):
    scene = write_scenario(tmp_path)
    words = ["--camera", "post", "--from", "2", "--to", "2.4", "--size", "32x18"]
    words += ["--quality", "draft", "--fps", "10", "--set", "output.sound={radius: 60, rate: 20}"]
    assert main(["render", str(scene), "-o", str(tmp_path / "a.mp4"), *words]) == 0
    folder = tmp_path / "a.sound"
    account = json.loads((tmp_path / "a.json").read_bytes())
    listener = table(folder / "listener.csv")
    assert [row["time"] for row in listener] == ["2.0", "2.05", "2.1", "2.15", "2.2", "2.25", "2.3"]
    for row, frame in zip(listener[::2], account["frames"], strict=True):
        for name in ("position", "forward", "up"):
            start = "" if name == "position" else f"{name}_"
            found = [float(row[f"{start}{axis}"]) for axis in "xyz"]
            assert found == pytest.approx(frame["camera"][name], abs=2e-5)
    sources = table(folder / "sources.csv")
    assert sources and all(float(row["nearest"]) <= 60 for row in sources)
    for source in sources:
        rows = table(folder / source["file"])
        assert {row["class"] for row in rows} == {source["class"]}
        places = np.array([[float(row[axis]) for axis in "xyz"] for row in rows])
        driven = np.linalg.norm(np.diff(places, axis=0), axis=1)
        speeds = np.array([float(row["speed"]) for row in rows])
        # The middle of a body drives as fast as it says.
        assert driven == pytest.approx(0.05 * speeds[1:], abs=0.03)
    assert json.loads((folder / "sound.json").read_bytes())["samples"] == 7
