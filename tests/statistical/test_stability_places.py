"""The picture does not depend on where in the world it is taken (architecture, law 2)."""

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    RAW,
    box,
    diffuse,
    frame_of,
    joined,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    write_scenario,
)
from scipy import stats

from sumo3dviz_pt.library.materials import matt
from sumo3dviz_pt.model.geometry import Mesh, Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import ORIGIN_GRID, Part, Prototype, Sky, Slots, View
from sumo3dviz_pt.pipeline.live import render_still
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job

pytestmark = pytest.mark.slow

SUN_HEIGHT, SUN_AZIMUTH = np.radians(35.0), np.radians(200.0)
SUN = np.array(
    [
        np.cos(SUN_HEIGHT) * np.sin(SUN_AZIMUTH),
        np.cos(SUN_HEIGHT) * np.cos(SUN_AZIMUTH),
        np.sin(SUN_HEIGHT),
    ]
)
SIZE = (96, 54)
ABOVE = 8.0
"""The camera looks down from this height [m]: a pixel is 0.1 m wide."""

WORST = 0.5 * ORIGIN_GRID - 1e-3


def car():
    """A body 0.15 m above the ground on four blocks, and a plate of 0.06 m beside it."""
    blocks = [
        box((x - 0.3, y - 0.1, 0.0), (x + 0.3, y + 0.1, 0.2))
        for x in (-0.9, -3.6)
        for y in (-0.8, 0.8)
    ]
    body = box((-4.6, -0.9, 0.15), (0.0, 0.9, 1.4))
    parts = (Part(joined(body, *blocks, box((-4.6, -2.2, 0), (0, -1.6, 0.06))), "paint"),)
    return Prototype("car", parts, parts)


def street(ground, *, sky=None):
    """A matt plane and room for a car."""
    return scene_of(
        [static("ground", ground, "grey")],
        {"grey": diffuse(0.5), "paint": matt({"type": "tint"})},
        sky=sky or Sky(SUN),
        prototypes=[car()],
        slots=Slots({"car": 1}),
    )


def shot(place, *, time=0.0):
    """A car at a place and a camera above it."""
    view = View(Transform.from_pose(np.add(place, (-2.3, 0, ABOVE)), pitch=-np.pi / 2), Lens(1.1))
    return frame_of(
        view, movers=[mover("vehicle:0", place, (0.3, 0.3, 0.3), prototype="car")], time=time
    )


def shaded_area(image):
    """Area of shadow on the ground [m^2]: missing light over that of the lit corners."""
    light = image.mean(axis=-1, dtype=np.float64)
    lit = np.median(np.concatenate([light[:6, :6].ravel(), light[:6, -6:].ravel()]))
    side = 2 * ABOVE * np.tan(0.55) / SIZE[0]
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]]
    # The body fills this box of the picture, its top 6.6 m below the eye.
    ahead, left = (SIZE[1] / 2 - rows - 0.5) * side, (SIZE[0] / 2 - columns - 0.5) * side
    ground = ~((np.abs(ahead) < 2.3 * 1.25) & (np.abs(left) < 0.9 * 1.25))
    return float(np.maximum(1 - light / lit, 0.0)[ground].sum() * side**2)


@pytest.fixture(scope="module")
def drive():
    """One open session over a road of 2 km, as in a film."""
    ground = plane(3000, centre=(1000, 0))
    quality = RAW.model_copy(update={"spp": 16, "pass_spp": 16})
    with session_of(street(ground), size=SIZE, quality=quality) as session:
        yield session


@pytest.fixture(scope="module")
def at_the_origin(drive):
    return drive.render(shot((0.0, 0.0, 0.0))).radiance


PLACES = [(x, y) for x in (125 - 2.3, 250, 375, 875, 1000.3, 1600, 1999) for y in (0.0, WORST)]


@pytest.mark.parametrize("place", PLACES, ids=str)
def test_the_contact_shadow_stays_on_a_drive_of_2_km(drive, at_the_origin, place):
    """Rays start up to 11 mm off the ground at the edge of the renderer's grid.

    A sun at 35 degrees makes 16 mm of it: along 12 m of outline 0.19 m^2.
    """
    expected = shaded_area(at_the_origin)
    assert 5 < expected < 20
    picture = drive.render(shot((*place, 0.0))).radiance
    assert np.isfinite(picture).all()
    assert shaded_area(picture) == pytest.approx(expected, abs=0.2)


@pytest.mark.parametrize("far", [(1000, 0), (0, 20_000), (-20_000, 20_000), (5e6, -5e6)], ids=str)
def test_whole_grid_steps_away_the_picture_is_the_same(at_the_origin, far):
    """To the last sample: what the renderer sees is the same to a nanometre."""
    ground = plane(3000, centre=np.add(far, (1000, 0)))
    quality = RAW.model_copy(update={"spp": 16, "pass_spp": 16})
    with session_of(street(ground), size=SIZE, quality=quality) as session:
        picture = session.render(shot((*far, 0.0))).radiance
    same = np.isclose(picture, at_the_origin, rtol=1e-3, atol=1e-5).all(axis=-1)
    assert same.mean() > 0.99
    assert shaded_area(picture) == pytest.approx(shaded_area(at_the_origin), abs=0.02)


@pytest.fixture(scope="module")
def pictured(tmp_path_factory):
    """A scene file's picture, its network moved by an offset [m]."""

    def picture(offset):
        place = write_scenario(tmp_path_factory.mktemp("town"), offset=offset, vehicles=6)
        request = Request(camera="post", size=(96, 54), spp=4)
        return render_still(load_job(place), request, 5.0).radiance

    return picture


def test_a_scene_file_gives_the_same_picture_anywhere(pictured):
    """From SUMO's coordinates to pixels, at 1 km, 28 km and 7,000 km from the origin."""
    here = pictured((0.0, 0.0))
    for offset in ((1000.0, 0.0), (20_000.0, -20_000.0), (5e6, 5e6)):
        np.testing.assert_allclose(pictured(offset), here, rtol=1e-2, atol=1e-3)


# Rotated and translated ---------------------------------------------------------------------


def patched_sky():
    """A smooth image sky with a bright side."""
    columns, rows = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(32) + 0.5) / 32)
    glow = np.exp(-40 * ((columns - 0.3) ** 2 + (rows - 0.3) ** 2))
    return (0.3 + 6 * glow)[..., None] * np.array([1.0, 0.8, 0.6])


def turned(sky, angle):
    """A sky turned counter-clockwise seen from above [rad]."""
    spin = Transform.from_pose((0, 0, 0), yaw=angle)
    sun = None if sky.sun_direction is None else spin.directions(sky.sun_direction[None])[0]
    return replace(sky, rotation=sky.rotation - angle, sun_direction=sun)


def blocks(session, movement):
    """Means of 8 x 8 blocks of pixels for some seeds, with the world moved."""
    view = View(
        movement @ Transform.from_pose((-7.0, -6.0, 3.0), yaw=np.radians(48), pitch=-0.35),
        Lens(1.0),
    )
    here = mover("vehicle:0", (0, 0, 0), (0.6, 0.2, 0.1), prototype="car")
    here = replace(here, world_from_body=movement @ here.world_from_body)
    runs = []
    for seed in range(8):
        image = session.render(frame_of(view, movers=[here], time=float(seed))).radiance
        runs.append(image.reshape(5, 8, 8, 8, 3).mean(axis=(1, 3)))
    return np.array(runs, dtype=np.float64)


@pytest.mark.parametrize("kind", ["sun", "image"])
def test_the_picture_turns_and_travels_with_the_world(kind):
    """z-test of 40 blocks x 3 colours, Sidak-corrected to 1 % of false alarms."""
    first = Sky(SUN) if kind == "sun" else Sky(None, image=patched_sky().astype(np.float32))
    stacks = []
    for angle, offset in ((0.0, (0.0, 0.0, 0.0)), (np.radians(37.0), (12_250.0, -2_750.0, 40.0))):
        movement = Transform.from_pose(offset, yaw=angle)
        flat = plane(60)
        ground = Mesh(movement.points(flat.vertices), flat.faces)
        with session_of(street(ground, sky=turned(first, angle)), size=(64, 40)) as session:
            stacks.append(blocks(session, movement))
    means, spreads = [s.mean(axis=0) for s in stacks], [s.var(axis=0, ddof=1) for s in stacks]
    error = np.sqrt(sum(spreads) / len(stacks[0]))
    # A thousandth of the picture's mean is below what anyone sees or the sky's texels carry.
    t = (means[0] - means[1]) / np.maximum(error, 1e-3 * means[0].mean())
    alpha = 1 - (1 - 0.01) ** (1 / t.size)
    limit = stats.t.ppf(1 - alpha / 2, df=2 * (len(stacks[0]) - 1))
    assert np.abs(t).max() < limit
    assert means[1].mean() == pytest.approx(means[0].mean(), rel=0.01)
