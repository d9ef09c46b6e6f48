"""Cameras where nobody should put one give finite pictures of what is there."""

import numpy as np
import pytest
from builders import (
    box,
    cube,
    diffuse,
    frame_of,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
    write_scenario,
)

from sumo3dviz_pt.job.settings import EulerianCamera
from sumo3dviz_pt.library.materials import matt
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import Slots, View
from sumo3dviz_pt.pipeline.live import render_still
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.cameras.aiming import aim_at, aim_of

pytestmark = pytest.mark.slow

SIZE = (64, 36)
RED, GREEN, GREY = (0.7, 0.05, 0.05), (0.05, 0.7, 0.05), (0.4, 0.4, 0.4)


@pytest.fixture(scope="module")
def yard():
    """Grey ground, green box in the north, a red wall in the east, a cube that moves."""
    scene = scene_of(
        [
            static("ground", plane(3000), "grey"),
            static("post", box((-2, 20, 0), (2, 22, 8)), "green"),
            static("wall", box((30, -40, 0), (31, 40, 20)), "red"),
        ],
        {
            "grey": diffuse(*GREY),
            "green": diffuse(*GREEN),
            "red": diffuse(*RED),
            "matt_tint": matt({"type": "tint"}),
        },
        prototypes=[cube(side=4.0)],
        slots=Slots({"cube": 1}),
    )
    with session_of(scene, size=SIZE) as session:
        yield session


def shown(session, view):
    """A frame with the cube in the south, checked."""
    body = mover("vehicle:0", (0, -30, 0), RED, prototype="cube")
    rendered = session.render(frame_of(view, movers=[body]))
    image = rendered.radiance
    assert np.isfinite(image).all() and (image >= 0).all()
    assert (rendered.tally.nonfinite, rendered.tally.negative) == (0, 0)
    # Nothing shines but a sky of 1; four samples of its light may say a little more.
    assert image.mean() <= 1.0 + 1e-4 and image.max() <= 1.2
    return image


def towards(position, target):
    """A view by `look_at`, as a scene file's camera makes it."""
    return View(
        aim_at(np.subtract(target, position)).placed(np.array(position)), Lens.of_degrees(60)
    )


def test_inside_a_body_it_is_dark(yard):
    """The cube's walls are closed: no light comes in, and none is made."""
    assert shown(yard, view_at([-2, -30, 2])).max() == 0.0


def test_under_the_road_only_the_skys_lower_half_is_seen(yard):
    """The plane has no back face, so from below it is black; below it is sky."""
    up = shown(yard, view_at([0, 0, -3], pitch=60))
    assert up.max() == 0.0
    np.testing.assert_allclose(shown(yard, view_at([0, 0, -3], pitch=-60)), 1.0, rtol=1e-4)


def test_from_2_km_the_ground_is_as_bright_as_from_2_m(yard):
    high = shown(yard, view_at([500, 500, 2000], pitch=-90))
    low = shown(yard, view_at([500, 500, 2], pitch=-90))
    assert high.mean() == pytest.approx(low.mean(), rel=0.02)
    assert high.mean() == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize("gap", [0.05, 0.051, 0.2])
@pytest.mark.parametrize("side", ["wall", "cube"])
def test_5_cm_from_paint_there_is_nothing_but_paint(yard, gap, side):
    if side == "wall":
        view = view_at([30 - gap, 3, 6], heading=90)
    else:
        view = view_at([gap, -30, 2], heading=270)
    image = shown(yard, view)
    middle = image[12:24, 24:40].mean(axis=(0, 1))
    assert middle[0] > 5 * middle[1] and middle[0] > 5 * middle[2]
    assert np.isclose(image, 1.0).all(axis=-1).mean() == 0, "no hole to look through"


def test_looking_at_nothing_shows_the_sky(yard):
    np.testing.assert_allclose(shown(yard, view_at([0, 0, 2], pitch=70)), 1.0, rtol=1e-4)


def test_an_empty_world_is_sky_all_around():
    with session_of(scene_of([], {}), size=SIZE) as session:
        for pitch in (-90, 0, 90):
            image = session.render(frame_of(view_at([0, 0, 0], pitch=pitch))).radiance
            np.testing.assert_allclose(image, 1.0, rtol=1e-4)


@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1e-5])
def test_straight_up_and_straight_down(yard, tilt):
    """`look_at` exactly above or below: north is the picture's foot or its top."""
    assert shown(yard, towards((0, 0, 2), (tilt, 0, 100))).min() > 0.999
    down = shown(yard, towards((0, 0, 90), (0, tilt, 0)))
    rows, columns = np.nonzero(down[..., 1] > 1.5 * down[..., 0])
    assert len(rows) > 1 and rows.mean() < 10 and abs(columns.mean() - 31.5) < 1.5


@pytest.mark.parametrize("pitch", [-90.0, 90.0])
def test_poles_by_pitch_are_rotations(pitch):
    settings = EulerianCamera(mode="eulerian", position=(1, 2, 3), heading=30, pitch=pitch)
    matrix = aim_of(settings).placed(np.array([1.0, 2.0, 3.0])).matrix[:3, :3]
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1.0)


@pytest.mark.parametrize("fov", [5, 150, 2, 170])
def test_narrow_and_wide_lenses(yard, fov):
    """The wall's edge falls where the pinhole says: x = tan(angle) / tan(fov / 2)."""
    distance = 30.0
    half = np.tan(np.radians(fov / 2))
    eye = [30 - distance, 40 + 0.5 * distance * half if fov < 60 else 40.0, 6]
    image = shown(yard, view_at(eye, heading=90, fov=fov))
    edge = (40.0 - eye[1]) / distance / half  # to the left, in half widths
    expected = (1 - edge) / 2 * SIZE[0]
    row = image[SIZE[1] // 2 - 1]
    red = np.nonzero(row[:, 0] > 3 * row[:, 1])[0]
    assert len(red) and abs(red.min() - expected) <= 1.5


def test_a_lens_that_sees_the_whole_ground_keeps_its_brightness(yard):
    """fov 150 straight down from 60 m: the plane is 0.4 everywhere but where things stand."""
    image = shown(yard, view_at([1000, 0, 60], pitch=-90, fov=150))
    assert image.mean() == pytest.approx(0.4, rel=0.02)


EYES = {
    "inside a car": ("[-3, -4.8, 0.7]", "[20, -4.8, 0.7]"),
    "under the road": ("[0, -3, -2]", "[20, -3, -2]"),
    "from under the road upwards": ("[0, -3, -2]", "[0, -3, 10]"),
    "2 km high": ("[0, 0, 2000]", "[0, 0, 0]"),
    "on the road": ("[30, -3.2, 0.0]", "[80, -3.2, 0.0]"),
    "at the zenith": ("[30, -3.2, 1.2]", "[30, -3.2, 100]"),
    "at the nadir": ("[30, -3.2, 12]", "[30, -3.2, 0]"),
    "out of the world": ("[0, 30000, 2]", "[0, 60000, 2]"),
}


@pytest.mark.parametrize(("position", "target"), EYES.values(), ids=EYES.keys())
def test_scene_files_with_odd_cameras(tmp_path, position, target):
    """The whole way from the scene file, with haze, cap and denoiser."""
    place = write_scenario(tmp_path, vehicles=4)
    text = place.read_text(encoding="utf-8")
    text = text.replace("[30.0, -22.0, 6]", position).replace("[5.0, -3.0, 0]", target)
    assert position in text and target in text
    place.write_text(text, encoding="utf-8")
    still = render_still(load_job(place), Request(camera="post", size=(32, 18), spp=2), 4.5)
    assert np.isfinite(still.radiance).all() and (still.radiance >= 0).all()
    assert still.rendered.tally.nonfinite == 0
    assert still.develop().dtype == np.uint8
