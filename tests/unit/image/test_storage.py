"""Traced frames survive being stored."""

import json
from dataclasses import replace

import numpy as np
import pytest
from stages import Stage

from sumo3dviz_pt.image.exr import read_layers, write_exr
from sumo3dviz_pt.image.traced import packed, unpacked
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.layers import MovingPart
from sumo3dviz_pt.render.averaging.average import accumulated

FAR = (41_000.0, 87_000.0)


def stored(frame, path):
    """Write a frame, and read it."""
    layers, text = packed(frame)
    write_exr(path, layers, attributes={"what": text})
    found, strings = read_layers(path)
    return unpacked(found, strings["what"])


@pytest.fixture
def frame():
    """A frame with a part that is not seen, and one that deforms."""
    one = Stage(noise=0.3, origin=FAR, turn=0.3).frame()
    hidden = MovingPart("vehicle:hidden/body", Transform(np.eye(4)))
    return replace(one, parts=(*one.parts, hidden), white=0.7, samples=4)


def test_what_was_traced_comes_back(frame, tmp_path):
    again = stored(frame, tmp_path / "a.exr")
    assert (again.white, again.samples) == (0.7, 4) and again.view.lens == frame.view.lens
    np.testing.assert_array_equal(
        again.view.world_from_camera.matrix, frame.view.world_from_camera.matrix
    )
    for name in ("radiance", "depth", "first_depth", "hit"):
        np.testing.assert_allclose(again.layers[name], frame.layers[name], rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(again.layers["albedo"], frame.layers["albedo"], atol=3e-3)
    np.testing.assert_allclose(again.layers["normal"], frame.layers["normal"], atol=1e-2)
    np.testing.assert_array_equal(again.numbers, frame.numbers)


def test_only_what_is_seen_is_stored_and_exactly_enough(frame, tmp_path):
    again = stored(frame, tmp_path / "a.exr")
    assert [part.name for part in again.parts] == ["vehicle:a/body"]
    apart = again.parts[0].world_from_part.matrix - frame.parts[0].world_from_part.matrix
    assert np.abs(apart).max() < 1e-5


def test_a_part_is_told_by_its_name_whatever_its_number(frame, tmp_path):
    swapped = replace(
        frame,
        layers=frame.layers | {"ids": np.where(frame.layers["ids"] == 1, 2, 0).astype(np.float32)},
        parts=frame.parts[::-1],
    )
    again = stored(swapped, tmp_path / "a.exr")
    assert [part.name for part in again.parts] == ["vehicle:a/body"]
    np.testing.assert_array_equal(again.numbers, frame.numbers)


def test_what_deforms_has_no_placement(frame, tmp_path):
    soft = replace(frame, parts=(MovingPart("person:a/body", None), *frame.parts[1:]))
    again = stored(soft, tmp_path / "a.exr")
    assert [(part.name, part.world_from_part) for part in again.parts] == [("person:a/body", None)]


def test_lamps_are_stored_only_where_there_are_any(frame):
    dark = np.zeros_like(frame.layers["radiance"])
    assert "excess" not in packed(replace(frame, layers=frame.layers | {"excess": dark}))[0]
    lit = dark + np.float32(3.0)
    assert "excess" in packed(replace(frame, layers=frame.layers | {"excess": lit}))[0]


def test_the_suns_disc_is_sky(frame):
    far = np.where(frame.layers["hit"] > 0, frame.layers["first_depth"], 1e8).astype(np.float32)
    layers, _ = packed(replace(frame, layers=frame.layers | {"first_depth": far, "depth": far}))
    sky = frame.layers["hit"] == 0
    assert (
        sky.any() and (layers["first_depth"][sky] == 0).all() and (layers["depth"][sky] == 0).all()
    )


def test_stored_frames_help_as_traced_ones_do(tmp_path):
    stage = Stage(noise=0.3, origin=FAR)
    frames = [
        replace(stage, eye=(0.2 * k, 0.0, 3.0), box=(14.0, 0.4 * k, 1.0)).frame(k) for k in range(5)
    ]
    again = [stored(frame, tmp_path / f"{k}.exr") for k, frame in enumerate(frames)]
    one = accumulated(frames[2], frames[:2] + frames[3:])
    other = accumulated(again[2], again[:2] + again[3:])
    # Rounding moves some points to the next pixel.
    assert np.abs(one.frames - other.frames).mean() < 0.1
    difference = np.abs(one.layers["radiance"] - other.layers["radiance"])
    assert difference.mean() < 0.01 * one.layers["radiance"].mean()


@pytest.mark.parametrize("broken", ["{}", "[]", "nonsense", '{"camera": 3}'])
def test_damage_is_told(frame, broken):
    layers, text = packed(frame)
    assert json.loads(text)["white"] == 0.7
    with pytest.raises(ValueError):
        unpacked({name: np.asarray(layer) for name, layer in layers.items()}, broken)
