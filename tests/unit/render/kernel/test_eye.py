"""Rays of every lens meet what its projection says, blur as optics say, and change nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    RAW,
    ball,
    cube,
    diffuse,
    frame_of,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.camera import Shutter
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import FrameState, Moment, Slots, View

pytestmark = pytest.mark.usefixtures("compiled")

GROUND = static("ground", plane(400.0), "plain")
PLAIN = {"plain": diffuse(0.5), "black": diffuse(0.0)}
PLACE = Transform.from_pose((3.0, -2.0, 5.0), yaw=0.6, pitch=-0.3)
WIDE = Lens.of_degrees(80.0)
LENSES = {
    "perspective": WIDE,
    "barrel": replace(WIDE, distortion=(-0.15, 0.03)),
    "fisheye": replace(Lens.of_degrees(180.0), projection="fisheye"),
    "360": replace(Lens.of_degrees(360.0), projection="equirectangular"),
    "180": replace(Lens.of_degrees(180.0), projection="equirectangular"),
    "plan": Lens(0.0, "orthographic", width=12.0),
    "both": replace(WIDE, stereo="side_by_side", eye_distance=0.8),
    "both 360": Lens(2 * np.pi, "equirectangular", stereo="top_bottom", eye_distance=0.8),
    "open": replace(WIDE, aperture=0.05, focus=6.0),
}


@pytest.mark.parametrize("name", LENSES)
def test_rays_meet_the_ground_where_the_projection_says(name):
    """All pixels that see the ground: their rays, as numpy has them, end on it to 0.02 px."""
    lens, size = LENSES[name], (64, 48)
    view = View(PLACE, lens)
    with session_of(scene_of([GROUND], PLAIN), size=size) as session:
        session.render(frame_of(view))
        depth = np.asarray(session.facts({"depth"}).layers["depth"], np.float64)
    points = view.points(depth, size)
    near = (depth > 0.0) & (depth < 100.0)
    assert near.mean() > 0.25
    # How far the hit is from the ground, across the ray, in widths of a pixel there.
    falling = np.abs(view.directions(size)[near][:, 2])
    reach = np.ones_like(depth) if lens.projection == "orthographic" else depth
    wrong = np.abs(points[near][:, 2]) / np.maximum(falling, 0.02)
    across = wrong * np.sqrt(1.0 - np.minimum(falling, 1.0) ** 2) + 1e-4 * wrong
    assert (across / reach[near]).max() < 0.02 * lens.pixel_width(size[0])


@pytest.mark.parametrize("name", ["fisheye", "360", "barrel", "plan"])
def test_a_known_point_is_seen_where_it_must_be(name):
    """The centroid of a small black ball before an even sky, to a tenth of a pixel."""
    lens, size = LENSES[name], (160, 120)
    local = np.array([6.0, 1.7, -1.1])
    view = View(PLACE, lens)
    middle = view.world_from_camera.points(local[None])[0]
    scene = scene_of([static("ball", ball(middle, 0.2), "black")], PLAIN)
    quality = RAW.model_copy(update={"spp": 64, "pass_spp": 64})
    with session_of(scene, size=size, quality=quality) as session:
        dark = 1.0 - session.render(frame_of(view)).radiance.mean(axis=-1)
    dark[dark < 0.01] = 0.0
    found = np.array([(dark * index).sum() / dark.sum() for index in np.indices(dark.shape)])
    expected = lens.project(local, size)[0]
    assert np.abs(found - expected).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(("focus", "away"), [(6.0, 12.0), (20.0, 8.0), (6.0, 6.0)])
def test_the_circle_of_confusion_of_a_point(focus, away):
    """Its diameter is that of the lens times |1 / focus - 1 / away|, in slopes."""
    size, aperture, radius = (160, 120), 0.06, 0.03
    lens = Lens(np.radians(20.0), aperture=aperture, focus=focus)
    view = View(Transform(np.eye(4)), lens)
    scene = scene_of([static("ball", ball((away, 0.0, 0.0), radius), "black")], PLAIN)
    quality = RAW.model_copy(update={"spp": 256, "pass_spp": 256})
    with session_of(scene, size=size, quality=quality) as session:
        dark = 1.0 - session.render(frame_of(view)).radiance.mean(axis=-1)
    dark[dark < 0.003] = 0.0
    rows, columns = np.indices(dark.shape)
    square = (rows - 59.5) ** 2 + (columns - 79.5) ** 2
    # Of an even disc the mean square distance is half its radius squared; discs add up.
    found = 2.0 * (dark * square).sum() / dark.sum()
    slope = 1.0 / lens.pixel_width(160)
    confusion = aperture * abs(1.0 / focus - 1.0 / away) * slope
    own = radius / away * slope
    assert found == pytest.approx(confusion**2 + own**2 + 1.0 / 3.0, rel=0.06)


def exposed(view, shutter, states) -> FrameState:
    """A frame whose moments show what `states` does at their times."""
    moments = [Moment(rows, states(at)) for at, rows in shutter.exposures()]
    return replace(states(shutter.middle), exposure=tuple(moments))


def crossing(speed, view):
    """A cube that drives across the picture."""

    def state(at):
        car = mover("car", (20.0, 0.0, 0.0), (0.0, 0.0, 0.0), yaw=np.pi / 2)
        matrix = car.world_from_body.matrix.copy()
        matrix[1, 3] += speed * at
        return frame_of(view, time=at, movers=[replace(car, world_from_body=Transform(matrix))])

    return state


@pytest.mark.slow
def test_the_blur_of_a_body_is_as_long_as_its_way():
    """Its edge is a ramp over speed x time of the shutter, in pixels there."""
    speed, span = 30.0, 0.02
    view, size = view_at((0.0, 0.0, 1.0), heading=90.0, fov=20.0), (200, 20)
    slots = Slots(near={"cube": 1})
    scene = scene_of([], {"matt_tint": diffuse(0.0)}, prototypes=[cube()], slots=slots)
    quality = RAW.model_copy(update={"spp": 256, "pass_spp": 16})
    widths = {}
    for moments, shutter in ((1, Shutter()), (16, Shutter(0.0, span, 16))):
        with session_of(scene, size=size, quality=quality) as session:
            frame = exposed(view, shutter, crossing(speed, view))
            picture = session.render(frame).radiance.mean(axis=-1)
        line = picture[9:11].mean(axis=0)
        # The second moment of an edge's slope: of an even ramp, its width squared over 12.
        slope = np.abs(np.diff(line[: int(np.argmin(line)) + 1]))
        at = np.arange(len(slope))
        middle = (slope * at).sum() / slope.sum()
        widths[moments] = 12.0 * (slope * (at - middle) ** 2).sum() / slope.sum()
    way = speed * span / (20.0 - 2.0 / 2) / view.lens.pixel_width(200)
    assert np.sqrt(widths[16] - widths[1]) == pytest.approx(way, rel=0.05)


def test_a_rolling_shutter_slants_what_moves():
    """Rows are seen one after the other: an upright edge leans by speed x delay."""
    speed, rolling = 30.0, 0.04
    view, size = view_at((0.0, 0.0, 1.0), heading=90.0, fov=20.0), (200, 60)
    slots = Slots(near={"cube": 1})
    scene = scene_of([], {"matt_tint": diffuse(0.0)}, prototypes=[cube(side=8.0)], slots=slots)
    with session_of(scene, size=size) as session:
        shutter = Shutter(0.0, 0.0, 16, rolling)
        picture = session.render(exposed(view, shutter, crossing(speed, view))).radiance[..., 0]
    dark = [float((1.0 - row).sum()) for row in picture[[5, 54]]]
    lean = speed * rolling * 49 / 60 / 16.0 / view.lens.pixel_width(200)
    step = speed * rolling / 16 / 16.0 / view.lens.pixel_width(200)
    assert dark[1] != dark[0] and abs(dark[1] - dark[0]) == pytest.approx(lean, abs=step + 1.0)


@pytest.mark.slow
def test_pictures_with_shutters_and_lenses_do_not_depend_on_what_came_before():
    view = View(PLACE, LENSES["open"])
    slots = Slots(near={"cube": 1})
    scene = scene_of(
        [GROUND], {**PLAIN, "matt_tint": diffuse(0.3)}, prototypes=[cube()], slots=slots
    )
    frames = [
        exposed(view, Shutter(0.0, 0.02, 4, 0.01).at(at), crossing(20.0, view))
        for at in (0.0, 0.04)
    ]
    with session_of(scene) as session:
        both = [session.render(frame).radiance for frame in frames]
    with session_of(scene) as session:
        alone = session.render(frames[1]).radiance
    np.testing.assert_array_equal(both[1], alone)


@pytest.mark.slow
def test_a_shutter_of_one_moment_without_blur_is_the_plain_picture():
    """Samples are shared out among moments, so that a scene at rest has the same mean."""
    view = view_at((0.0, -9.0, 3.0), pitch=-15)
    still = frame_of(view)
    quality = RAW.model_copy(update={"spp": 256, "pass_spp": 256})
    with session_of(scene_of([GROUND], PLAIN), quality=quality) as session:
        plain = session.render(still).radiance
        four = tuple(Moment((0.0, 1.0), still) for _ in range(4))
        shared = session.render(replace(still, exposure=four)).radiance
    assert np.abs(plain.mean() - shared.mean()) < 2e-3 and np.abs(plain - shared).mean() < 0.02


def test_layers_after_an_exposure_show_its_middle():
    view = view_at((0.0, 0.0, 1.0), heading=90.0, fov=20.0)
    slots = Slots(near={"cube": 1})
    scene = scene_of([], {"matt_tint": diffuse(0.0)}, prototypes=[cube()], slots=slots)
    states = crossing(60.0, view)
    with session_of(scene, size=(200, 20)) as session:
        session.render(exposed(view, Shutter(0.0, 0.02, 4), states))
        after = session.facts({"depth"}).layers["depth"]
        session.render(states(0.01))
        middle = session.facts({"depth"}).layers["depth"]
    np.testing.assert_array_equal(after, middle)


def test_mitsubas_tracer_says_that_it_has_no_such_lens():
    quality = RAW.model_copy(update={"tracer": "path"})
    scene, frame = scene_of([GROUND], PLAIN), frame_of(View(PLACE, LENSES["fisheye"]))
    with (
        session_of(scene, quality=quality) as session,
        pytest.raises(ConfigError, match="tracer: kernel"),
    ):
        session.render(frame)
