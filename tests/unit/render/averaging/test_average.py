"""Frames help each other: less noise, no ghosts, no lag."""

from dataclasses import replace

import numpy as np
import pytest
from stages import LENS, SIZE, Stage

from sumo3dviz_pt.model.layers import Layers, MovingPart
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.render.averaging.average import Averager, accumulated


def error(frame_or_result, truth):
    """Return the error of the radiance in each pixel, (h, w)."""
    return np.abs(frame_or_result.layers["radiance"] - truth.layers["radiance"]).mean(axis=-1)


def known_by(other, frame):
    """Return what another frame knows of a frame, (h, w)."""
    return accumulated(frame, [other]).frames > 1.0


def reached(frame):
    """Return where something near is seen, (h, w)."""
    distance = frame.layers["first_depth"]
    return (distance > 0) & (distance < 30)


def sampled(stage, seed=None, *, samples=2, places=16):
    """Trace a stage through places side by side in each pixel: all, or some by chance."""
    pixel = LENS.pixel_angle(SIZE[0])
    offsets = (np.arange(places) + 0.5) / places - 0.5
    traced = [replace(stage, yaw=stage.yaw + pixel * at).frame() for at in offsets]
    picks = np.indices((places, *SIZE[::-1]))[0]
    if seed is not None:
        picks = np.random.default_rng(seed).integers(places, size=(samples, *SIZE[::-1]))
    layers = {}
    for name, layer in traced[0].layers.items():
        each = np.stack([one.layers[name] for one in traced])
        found = np.take_along_axis(each, picks.reshape(*picks.shape, *[1] * (layer.ndim - 2)), 0)
        layers[name] = found[0] if name in ("ids", "first_depth") else found.mean(axis=0)
    return replace(stage.frame(), layers=Layers(layers), samples=samples)


def test_a_frame_alone_stays_as_it_is():
    frame = Stage(noise=0.2).frame()
    alone = accumulated(frame, [])
    for name, layer in frame.layers.items():
        np.testing.assert_array_equal(alone.layers[name], layer)
    assert (alone.frames == 1).all()


def test_equal_frames_without_noise_change_nothing():
    frame = Stage().frame()
    result = accumulated(frame, [frame, frame, frame])
    for name, layer in frame.layers.items():
        np.testing.assert_allclose(result.layers[name], layer, rtol=2e-6, atol=1e-6)
    assert (result.frames == 4).all()


def test_noise_falls_with_the_number_of_frames_where_nothing_moves():
    stage, truth = Stage(noise=0.3), Stage().frame()
    frames = [stage.frame(seed) for seed in range(9)]
    result = accumulated(frames[0], frames[1:])
    hit = truth.layers["hit"] > 0
    before, after = (error(one, truth)[hit].mean() for one in (frames[0], result))
    # One in nine: a third of the noise; the gate throws a little away.
    assert after < 0.40 * before
    assert result.frames[hit].mean() > 8.0


@pytest.mark.parametrize("yaw", [0.0, 0.4])
@pytest.mark.parametrize("origin", [(0.0, 0.0), (41_000.0, 87_000.0)])
def test_what_moves_takes_its_samples_along(yaw, origin):
    stage = Stage(noise=0.3, origin=origin)
    steps = [-3, -2, -1, 1, 2, 3]
    others = [
        replace(stage, box=(14.0 + 0.4 * k, 0.5 * k, 1.0), turn=yaw + 0.05 * k).frame(k + 10)
        for k in steps
    ]
    centre = replace(stage, turn=yaw)
    frame, truth = centre.frame(), replace(centre, noise=0.0).frame()
    result = accumulated(frame, others)
    on_it = truth.numbers > 0
    assert error(result, truth)[on_it].mean() < 0.65 * error(frame, truth)[on_it].mean()
    # Most of it is seen in all seven frames.
    assert result.frames[on_it].mean() > 4.0


@pytest.mark.parametrize("step", [0.3, 1.0, 3.0])
def test_a_moving_box_leaves_no_ghost(step):
    frames = [Stage(box=(14.0, step * k, 1.0)).frame() for k in (-4, -3, -2, -1, 0, 1, 2, 3, 4)]
    truth = frames.pop(4)
    result = accumulated(truth, frames)
    assert error(result, truth).max() < 0.03
    assert result.frames.mean() > 6.0


def test_a_moving_camera_blurs_nothing():
    # Half a pixel aside, half of everything lies between pixels.
    steps = [k for k in range(-6, 7) if k]
    frames = [Stage(eye=(0.31 * k, 0.07 * k, 3.0), yaw=0.004 * k).frame() for k in steps]
    truth = Stage().frame()
    result = accumulated(truth, frames)
    assert error(result, truth).mean() < 2e-3
    near = reached(truth)
    assert result.frames[near].mean() > 6.0


def test_a_moving_camera_gets_rid_of_noise():
    steps = [k for k in range(-4, 5) if k]
    frames = [
        Stage(eye=(0.31 * k, 0.07 * k, 3.0), yaw=0.004 * k, noise=0.3).frame(k + 10) for k in steps
    ]
    frame, truth = Stage(noise=0.3).frame(), Stage().frame()
    result = accumulated(frame, frames)
    near = reached(truth)
    assert error(result, truth)[near].mean() < 0.5 * error(frame, truth)[near].mean()


def test_what_one_comes_near_to_gets_no_blotches():
    """A denoiser takes noise that neighbouring pixels share for a crumpled surface."""
    frames = [Stage(eye=(8.0 - 0.8 * k, 0.0, 3.0), noise=0.3).frame(k + 10) for k in range(6)]
    frame, others = frames[0], frames[1:]
    truth = Stage(eye=(8.0, 0.0, 3.0)).frame()
    result = accumulated(frame, others)
    on_it = truth.numbers > 0
    rest = result.layers["radiance"].mean(axis=-1) / truth.layers["radiance"].mean(axis=-1) - 1.0
    both = on_it[:, 1:] & on_it[:, :-1]
    shared = (rest[:, 1:] * rest[:, :-1])[both].mean() / np.square(rest[on_it]).mean()
    assert on_it.sum() > 500
    assert shared < 0.16
    assert error(result, truth)[on_it].mean() < 0.9 * error(frame, truth)[on_it].mean()


def riding(k, wobble=0.0):
    """A camera that follows a box at the same speed, about."""
    return Stage(eye=(0.5 * k, wobble * k, 3.0), box=(6.0 + 0.5 * k, 0.0, 1.5))


@pytest.mark.slow
@pytest.mark.parametrize("wobble", [0.0, 3e-5])
def test_rims_of_what_rides_with_the_camera_are_smooth(wobble):
    steps = [k for k in range(-4, 5) if k]
    others = [sampled(riding(k, wobble), k + 10) for k in steps]
    frame, truth = sampled(riding(0), 0), sampled(riding(0))
    covered = np.mean(
        [sampled(riding(0), seed, samples=1).numbers > 0 for seed in range(64)], axis=0
    )
    rim = (covered > 0.2) & (covered < 0.8)
    assert rim.sum() > 20
    before, after = (error(one, truth)[rim].mean() for one in (frame, accumulated(frame, others)))
    assert after < 0.65 * before


def test_what_rides_with_the_camera_leaves_no_ghost():
    frames = [riding(k).frame() for k in range(-4, 5)]
    truth = frames.pop(4)
    result = accumulated(truth, frames)
    assert error(result, truth).max() < 0.03


def test_what_crosses_before_a_creeping_camera_leaves_no_ghost():
    """Where a camera hardly moves, what stands goes with it as well as the own vehicle does."""
    frames = [
        Stage(eye=(1e-4 * k, 0.0, 3.0), box=(14.0, 1.0 * k, 1.0), noise=0.2).frame(k + 10)
        for k in range(-4, 5)
    ]
    frame = frames.pop(4)
    assert not _rims(frame, frames).any()


def test_what_passes_before_what_rides_with_the_camera_is_no_rim():
    """As wipers do before the bonnet."""
    frames = [riding(k).frame() for k in range(-4, 5)]
    rows, columns = np.nonzero(frames[4].numbers)
    top, left = int(rows.mean()) - 4, int(columns.mean()) - 4
    swept = []
    for k, frame in enumerate(frames):
        ids = frame.layers["ids"].copy()
        ids[top : top + 8, left + k : left + k + 8] = 0.0
        swept.append(replace(frame, layers=frame.layers | {"ids": ids}))
    centre = swept.pop(4)
    rims = _rims(centre, swept)
    assert not rims[top + 2 : top + 6, left : left + 16].any()


def _rims(frame, others):
    """Return the rims of what rides with the camera, (h, w)."""
    rims = Averager().rims(frame, others)
    return np.zeros(frame.numbers.shape, bool) if rims is None else rims


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_light_that_changes_does_not_lag(noise):
    before = [Stage(light=0.5, noise=noise).frame(seed) for seed in range(1, 5)]
    after = Stage(light=0.25, noise=noise).frame()
    result = accumulated(after, before)
    truth = Stage(light=0.25).frame()
    lit = truth.layers["hit"] > 0
    assert result.frames[lit].max() < 1.2
    assert error(result, truth)[lit].mean() < 1.1 * error(after, truth)[lit].mean() + 1e-6


def test_the_edge_of_a_shadow_moves_with_it():
    stage = Stage(box=None, noise=0.05)
    others = [replace(stage, shade=0.5 * k).frame(k + 10) for k in (-4, -3, -2, -1, 1, 2, 3, 4)]
    frame, truth = replace(stage, shade=0.0).frame(), Stage(box=None, shade=0.0).frame()
    result = accumulated(frame, others)
    assert error(result, truth).max() < 0.2 * truth.layers["radiance"].max()
    assert error(result, truth).mean() < error(frame, truth).mean()


def test_strangers_and_what_deforms_help_nobody():
    frame, other = Stage().frame(), Stage(name="vehicle:b/body").frame(1)
    on_it = frame.numbers > 0
    known = known_by(other, frame)
    assert not known[on_it].any()
    soft = replace(frame, parts=(MovingPart("vehicle:a/body", None),))
    known = known_by(soft, soft)
    assert not known[on_it].any()
    assert known[~on_it].mean() > 0.9


def test_a_teleport_of_the_camera_rejects_all():
    frame = Stage().frame()
    elsewhere = Stage(eye=(-500.0, 300.0, 3.0), yaw=np.pi, box=None).frame()
    result = accumulated(frame, [elsewhere])
    hit = frame.layers["hit"] > 0
    assert (result.frames[hit] == 1).all()
    np.testing.assert_allclose(result.layers["radiance"], frame.layers["radiance"], atol=1e-6)


@pytest.mark.parametrize("stage", [Stage(box=None, yaw=0.0), Stage(eye=(0, 0, 1e-3), box=None)])
def test_an_empty_scene_is_finite(stage):
    frame = stage.frame()
    sky = TracedFrame(
        Layers({name: np.zeros_like(layer) for name, layer in frame.layers.items()}),
        frame.view,
    )
    turned = replace(sky, view=replace(sky.view, lens=Lens.of_degrees(40)))
    for others in ([sky], [frame, turned]):
        for centre in (frame, sky, turned):
            result = accumulated(centre, others)
            assert all(np.isfinite(layer).all() for layer in result.layers.values())


def test_the_order_of_neighbours_hardly_matters():
    frames = [Stage(eye=(0.2 * k, 0.0, 3.0), noise=0.2).frame(k) for k in range(5)]
    one = accumulated(frames[2], [frames[k] for k in (0, 1, 3, 4)])
    other = accumulated(frames[2], [frames[k] for k in (4, 0, 3, 1)])
    np.testing.assert_allclose(one.layers["radiance"], other.layers["radiance"], atol=1e-6)
