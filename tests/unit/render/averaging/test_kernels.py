"""Kernels find what NumPy finds in double precision, for all lenses and neighbours."""

from dataclasses import replace

import averaging
import drjit as dr
import numpy as np
import pytest
from stages import Stage

from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.render.averaging import records
from sumo3dviz_pt.render.averaging.average import Averager, accumulated

STEPS = [k for k in range(-3, 4) if k]
STANDING = [Stage(noise=0.3).frame(k + 9) for k in STEPS]
MOVING = [
    Stage(eye=(0.31 * k, 0.07 * k, 3.0), yaw=0.004 * k, noise=0.2).frame(k + 9) for k in STEPS
]
RIDING = [
    Stage(eye=(0.5 * k, 3e-5 * k, 3.0), box=(6.0 + 0.5 * k, 0.0, 1.5), noise=0.2).frame(k + 9)
    for k in STEPS
]
FRAMES = {
    "standing": (Stage(noise=0.3).frame(), STANDING),
    "moving": (Stage(noise=0.2).frame(), MOVING),
    "riding": (Stage(box=(6.0, 0.0, 1.5), noise=0.2).frame(), RIDING),
    "both": (Stage(noise=0.2).frame(), STANDING[:2] + MOVING[:3]),
}


@pytest.mark.parametrize("kind", FRAMES)
def test_kernels_find_what_numpy_finds(kind):
    frame, others = FRAMES[kind]
    layers, frames = averaging.averaged(frame, others)
    result = accumulated(frame, others)
    # Between two pixels the last digit decides.
    agree = np.abs(result.frames - frames) < 1e-4
    assert agree.mean() > (0.9999 if kind == "standing" else 0.97)
    for name, layer in layers.items():
        found = np.abs(result.layers[name] - layer)
        near = found <= 1e-5 * np.maximum(np.abs(layer), 1.0)
        assert near[agree].mean() > 0.999
    np.testing.assert_array_equal(result.layers["ids"], frame.layers["ids"])
    assert result.frames.mean() == pytest.approx(frames.mean(), rel=1e-3)


@pytest.mark.parametrize(
    "lens",
    [
        Lens.of_degrees(60),
        replace(Lens.of_degrees(60), distortion=(-0.2, 0.04)),
        Lens(2.5, "fisheye"),
        Lens(2.0 * np.pi, "equirectangular"),
        replace(Lens.of_degrees(80), shift=0.03),
    ],
)
def test_all_lenses_find_pixels_where_they_are(lens):
    """A camera that hardly moves sees everything in the same pixel; what has no level differs."""
    frame = MOVING[0]
    grey = np.full_like(frame.layers["radiance"], 0.5)
    layers = frame.layers | {"radiance": grey, "ids": np.zeros_like(frame.layers["ids"])}
    flat = {"first_depth": np.full_like(layers["depth"], 20.0), "hit": np.ones_like(layers["hit"])}
    layers = Layers({**layers, **flat, "depth": flat["first_depth"]})
    centre = replace(frame, layers=layers, view=replace(frame.view, lens=lens), parts=())
    near = replace(MOVING[1].view, world_from_camera=frame.view.world_from_camera, lens=lens)
    step = near.world_from_camera.matrix.copy()
    step[:3, 3] += 1e-4
    near = replace(near, world_from_camera=type(near.world_from_camera)(step))
    other = replace(centre, view=near)
    _, frames = averaging.averaged(centre, [other])
    result = accumulated(centre, [other])
    assert (result.frames > 1.9).mean() > 0.9
    assert np.abs(result.frames - frames).mean() < 0.02


def test_the_number_of_threads_changes_no_bit():
    frame, others = FRAMES["moving"]
    before = dr.thread_count()
    results = []
    for threads in (1, 3):
        dr.set_thread_count(threads)
        results.append(accumulated(frame, others))
    dr.set_thread_count(before)
    one, many = results
    np.testing.assert_array_equal(many.frames, one.frames)
    for name, layer in one.layers.items():
        np.testing.assert_array_equal(many.layers[name], layer)


def test_frames_that_help_several_are_brought_to_the_device_once(monkeypatch):
    brought = []
    bring = records.HeldFrame.of
    monkeypatch.setattr(
        records.HeldFrame, "of", lambda *given: brought.append(given) or bring(*given)
    )
    averager = Averager()
    for number in range(1, 5):
        others = [STANDING[number - 1], STANDING[number + 1]]
        averager.accumulated(STANDING[number], others)
    assert len(brought) == 6
    brought.clear()
    one = averager.accumulated(STANDING[1], [STANDING[0], STANDING[2]])
    fresh = accumulated(STANDING[1], [STANDING[0], STANDING[2]])
    np.testing.assert_array_equal(one.layers["radiance"], fresh.layers["radiance"])
