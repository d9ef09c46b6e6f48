"""Layers of earlier versions are read, and those of later ones refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.image.exr import write_channels, write_parts
from sumo3dviz_pt.pipeline.films import layers as places
from sumo3dviz_pt.pipeline.films.layers import FORM
from sumo3dviz_pt.pipeline.films.stored_layers import read_frame

DEPTH = np.arange(6, dtype=np.float32).reshape(2, 3)
NUMBERS = np.full((2, 3), 7, np.uint32)
UP = DEPTH.astype(np.float16)


def write(folder: Path, form: int) -> Path:
    """Write what is said of a frame."""
    camera = {"size": [3, 2], "focal": 2.0, "centre": [1.0, 0.5]}
    camera["world_from_camera"] = np.eye(4).tolist()
    said = {
        "form": form,
        "frame": 0,
        "time": 4.0,
        "camera": camera,
        "things": {"7": ["a:b", "car"]},
    }
    places.said_file(folder, 0).parent.mkdir(parents=True)
    places.said_file(folder, 0).write_text(json.dumps(said), "utf-8")
    return folder


def test_frames_of_one_part_and_of_several_are_the_same(tmp_path: Path) -> None:
    old, new = write(tmp_path / "old", 1), write(tmp_path / "new", FORM)
    normals = {f"normals.{k}": UP for k in "XYZ"}
    channels = {"depth.Z": DEPTH, **normals, "instance.id": NUMBERS}
    write_channels(places.channels_file(old, 0), channels, {})
    parts = {"depth": {"Z": DEPTH}, "normals": dict.fromkeys("XYZ", UP)}
    write_parts(places.channels_file(new, 0), {**parts, "instance": {"id": NUMBERS}})
    for folder in (old, new):
        layers = read_frame(folder, 0).layers
        np.testing.assert_array_equal(layers["depth"], DEPTH)
        np.testing.assert_array_equal(layers["instance"], NUMBERS)
        assert layers["normals"].shape == (2, 3, 3)


def test_frames_of_a_later_version_are_refused(tmp_path: Path) -> None:
    folder = write(tmp_path / "later", FORM + 1)
    with pytest.raises(InputError, match="is of another version; render the frame again"):
        read_frame(folder, 0)
