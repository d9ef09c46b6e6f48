"""What falls in pictures of every projection: whole, also where a picture's ends meet behind it."""

import numpy as np
import pytest
from raining import falling_at, view_from

from sumo3dviz_pt.model.falling import Puffs, SkyLight
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render.falling.drawn import draw_puffs, splashes, strokes_of, with_falling
from sumo3dviz_pt.render.falling.drops import Drops, Reach, drops_before, rain
from sumo3dviz_pt.render.falling.strokes import Veil, draw

GREY = SkyLight((0.5, 0.5, 0.5))
SIZE = (320, 160)
ALL_ROUND = Lens(2.0 * np.pi, "equirectangular")
LENSES = {
    "perspective": Lens.of_degrees(60.0),
    "distorted": Lens(1.2, distortion=(-0.1, 0.01)),
    "orthographic": Lens(0.0, "orthographic", width=12.0),
    "fisheye": Lens(np.radians(180.0), "fisheye"),
    "fisheye all round": Lens(np.radians(360.0), "fisheye"),
    "half round": Lens(np.pi, "equirectangular"),
    "all round": ALL_ROUND,
}
EYES = {
    f"{name}, {shift:+.0e}": Lens(opening, "equirectangular", shift=shift)
    for name, opening in (("all round", 2.0 * np.pi), ("half round", np.pi))
    for shift in (0.0315, -0.0315)
}


def strokes(drops, lens, falling, cover=1e-6):
    focal = 1.0 / lens.pixel_width(SIZE[0])
    return strokes_of(
        drops, falling, Reach(cover, focal, falling.exposure), GREY, lens=lens, size=SIZE
    )


def flying(place, velocity, exposure):
    half = 0.5 * exposure * np.array(velocity)
    return Drops(
        (place - half)[None], (place + half)[None], np.full(1, 0.003), np.full(1, 8.0), np.ones(1)
    )


def empty(size=SIZE, far=30.0):
    return Veil(np.full(size[::-1], far, np.float32), np.zeros(size[::-1], np.float32))


def covered(veil):
    """Optical depth laid over each pixel, (h, w)."""
    return veil._depth.reshape(veil.size[::-1])


@pytest.mark.parametrize("lens", [*LENSES.values(), *EYES.values()], ids=[*LENSES, *EYES])
def test_no_streak_is_longer_than_what_was_seen_of_it(lens):
    """Wind blows across: many a drop passes behind the camera from one side to the other."""
    falling = falling_at(exposure=0.02, rain=20.0, wind=(3.0, 9.0), aperture=0.0)
    drops, _ = drops_before(falling, rain(), 20.0, lens=lens, size=SIZE)
    far = np.linalg.norm(0.5 * (drops.first + drops.last) - (0.0, 0.0, 2.0), axis=1) > 1.5
    found = strokes(drops.only(far), lens, falling)
    assert len(found.away) > 30
    # 12 m/s for 20 ms, at least 1.5 m away; lines of latitude get longer towards the poles.
    middle = 0.5 * (found.starts[0] + found.ends[0])
    rise = np.pi * (0.5 - (middle + 0.5) / SIZE[1]) if lens.projection == "equirectangular" else 0.0
    stretch = 2.0 / np.maximum(np.cos(rise), 0.02)
    wide = found.away if lens.projection != "orthographic" else 1.0
    most = stretch * 0.26 / wide / lens.pixel_width(SIZE[0]) + 2.0
    length = np.hypot(*(found.ends - found.starts))
    if lens.projection == "fisheye":
        # Rings around what lies right behind are drawn out likewise.
        aside = [np.hypot(*(ends - [[79.5], [159.5]])) for ends in (found.starts, found.ends)]
        angle = np.clip(np.maximum(*aside) * lens.opening / SIZE[0], 1e-3, np.pi - 0.05)
        most *= 1.5 * angle / np.sin(angle)
    assert (length < most).all()


@pytest.mark.parametrize(
    "lens", [ALL_ROUND, *list(EYES.values())[:2]], ids=["mono", "left", "right"]
)
def test_a_streak_across_the_seam_is_seen_at_both_ends_of_the_picture(lens):
    falling = falling_at(exposure=0.02, aperture=0.0)
    found = strokes(flying(np.array([-4.0, 0.0, 2.0]), (0.0, 30.0, 0.0), 0.02), lens, falling)
    veil = empty()
    draw(veil, found)
    columns = np.flatnonzero(covered(veil).max(axis=0) > 0.0)
    assert set(columns) == {*range(len(columns) // 2 + 2), *range(320 - 9, 320)} & set(columns)
    assert 0 in columns and 319 in columns and 6 <= len(columns) < 14
    # Each pixel once: as much of it as in a picture that is turned away from the seam.
    turned = falling_at(exposure=0.02, aperture=0.0, view=view_from(yaw=1.0))
    whole = empty()
    draw(whole, strokes(flying(np.array([-4.0, 0.0, 2.0]), (0.0, 30.0, 0.0), 0.02), lens, turned))
    assert covered(veil).sum() == pytest.approx(covered(whole).sum(), rel=0.02)


def test_half_a_turn_shows_nothing_of_what_is_behind():
    falling = falling_at(exposure=0.02, aperture=0.0)
    behind = flying(np.array([-4.0, 0.0, 2.0]), (0.0, 30.0, 0.0), 0.02)
    for name in ("half round", "perspective", "fisheye"):
        assert not len(strokes(behind, LENSES[name], falling).away), name


def test_spray_on_the_seam_is_seen_at_both_ends_of_the_picture():
    puffs = Puffs(np.array([[-10.0, 0.0, 2.0]]), np.array([1.0]), np.array([0.5]))
    veil = empty()
    draw_puffs(veil, falling_at(puffs=puffs), GREY, lens=ALL_ROUND, size=SIZE)
    found = covered(veil)
    np.testing.assert_allclose(found[:, :8], found[:, :-9:-1], atol=1e-4)
    assert found[80, 0] > 0.3 and found[80, 160] == 0.0


def ground(lens, size=SIZE):
    """A level road 2 m below the camera."""
    down = np.minimum(lens.rays(size)[..., 2], 0.0)
    away = np.where(down < -0.02, 2.0 / np.maximum(-down, 0.02), 0.0)
    hit = (away > 0.0).astype(np.float32)
    return Layers({"depth": away.astype(np.float32), "hit": hit})


@pytest.mark.parametrize("lens", [ALL_ROUND, LENSES["fisheye all round"]], ids=["equi", "fisheye"])
def test_drops_splash_all_around_cameras_that_see_it(lens):
    falling = falling_at(rain=50.0, aperture=0.0)
    found = splashes(falling, GREY, ground(lens), lens=lens, size=SIZE)
    assert found is not None
    column = 0.5 * (found.starts[1] + found.ends[1])
    if lens is ALL_ROUND:
        counts = np.histogram(column, bins=4, range=(0.0, 320.0))[0]
        assert counts.min() > 0.5 * counts.max()
    aside = np.hypot(*(found.starts - np.array([[79.5], [159.5]])))
    assert (aside > 0.3 * SIZE[0]).sum() > 20


@pytest.mark.parametrize("stereo", ["side_by_side", "top_bottom"])
def test_each_eye_of_a_turn_sees_what_falls_as_alone(stereo):
    lens = Lens(2.0 * np.pi, "equirectangular", stereo=stereo)
    size = (320, 320) if stereo == "top_bottom" else (640, 160)
    seen = Layers({name: np.zeros(size[::-1], np.float32) for name in ("depth", "hit")})
    placed = view_from().world_from_camera
    falling = falling_at(exposure=0.02, rain=30.0, wind=(0.0, 12.0), aperture=0.0)
    dark = np.zeros((*size[::-1], 3), np.float32)
    found = with_falling(dark, seen, View(placed, lens), falling, GREY)
    for part, eye in lens.halves(size):
        half = Layers({name: layer[part] for name, layer in seen.items()})
        alone = with_falling(dark[part], half, View(placed, eye), falling, GREY)
        np.testing.assert_array_equal(found[part], alone)
        # What a column shows is as much at the seam as elsewhere.
        shown = alone[40:120].mean(axis=(0, 2))
        assert shown[[0, 1, -2, -1]].mean() == pytest.approx(shown.mean(), rel=0.5)
