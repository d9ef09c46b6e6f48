"""Scenes whose light is known by formula: walls, cavities, edges, mirrors, lamps.

References:
    Siegel and Howell, Thermal Radiation Heat Transfer, 4th ed. 2002, appendix C
    (configuration factors C-1, C-3: strip and rectangle seen from an element).
    Walsh 1958, Photometry, chapter on the integrating sphere.
"""

import numpy as np
import pytest
from builders import (
    RAW,
    ball,
    box,
    constant_sky,
    diffuse,
    frame_of,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)
from significance import sidak_z, standard_error

from sumo3dviz_pt.library.materials import MATERIALS, two_sided
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import LampSet, Sky

pytestmark = pytest.mark.slow

SUN_RADIUS = np.radians(0.2665)
"""Mean angular radius of the sun's disc: 959.63 arc seconds (IAU 1976)."""

SAMPLED = [False, True]
"""Whether paths aim at lamps (`LampSet.sampled`)."""

ROUNDING = 0.003
"""Relative error of maps and meshes that stand for what is smooth."""


def quality(spp, **more):
    return RAW.model_copy(update={"spp": spp, "pass_spp": min(spp, 256), **more})


def down(height, *, fov=60.0, at=(0.0, 0.0)):
    """A camera that looks straight down, north up in the picture."""
    return view_at([*at, height], pitch=-90.0, fov=fov)


def ground_points(view, size, *, z=0.0):
    """Where the middle of every pixel meets a level plane, (h, w, 2) [m]."""
    half = view.lens.half_width
    rows, columns = np.mgrid[: size[1], : size[0]]
    left = (1 - 2 * (columns + 0.5) / size[0]) * half
    up = (1 - 2 * (rows + 0.5) / size[1]) * half * size[1] / size[0]
    rays = np.stack([np.ones_like(left), left, up], axis=-1)
    rays = rays @ view.world_from_camera.matrix[:3, :3].T
    reach = (z - view.position[2]) / rays[..., 2]
    return view.position[:2] + reach[..., None] * rays[..., :2]


def assert_agree(radiance, expected, *, rounding=ROUNDING, blocks=(4, 4)):
    """Blocks of pixels against a formula, each by its own noise; Sidak over all blocks.

    Args:
        radiance: (h, w, 3); grey scenes, so that channels share their noise.
        expected: Of each pixel, (h, w).
        rounding: Relative error that is no noise.
        blocks: Rows and columns of a block.
    """
    rows, columns = blocks
    error = radiance.astype(np.float64).mean(axis=-1) - expected
    height, width = (error.shape[0] // rows, error.shape[1] // columns)
    cut = error[: height * rows, : width * columns]
    cells = cut.reshape(height, rows, width, columns).swapaxes(1, 2).reshape(-1, rows * columns)
    level = np.asarray(expected)[: height * rows, : width * columns]
    level = level.reshape(height, rows, width, columns).swapaxes(1, 2).reshape(len(cells), -1)
    limit = sidak_z(len(cells)) * standard_error(cells, axis=1) + rounding * level.mean(axis=1)
    # With few pixels a block's own spread is Student's, not Gauss's: the floor of all helps.
    floor = sidak_z(len(cells)) * np.median(standard_error(cells, axis=1))
    worst = np.abs(cells.mean(axis=1)) - np.maximum(limit, floor)
    assert worst.max() <= 0, f"{worst.max():g} beyond noise"
    assert abs(cut.mean()) <= rounding * level.mean() + 4 * standard_error(cut)


# Walls --------------------------------------------------------------------------------------


@pytest.mark.parametrize("height", [0.5, 3.0])
def test_a_black_wall_takes_its_share_of_the_sky(height):
    """An element at distance d before an endless wall sees (1 + cos(atan(h/d))) / 2 of the sky."""
    wall = box((-2000, 0, 0), (2000, 0.1, height))
    parts = [static("ground", plane(3000), "g"), static("wall", wall, "black")]
    scene = scene_of(parts, {"g": diffuse(0.6), "black": diffuse(0.0)})
    view, size = down(4.0, at=(0.0, -2.5), fov=60.0), (48, 48)
    with session_of(scene, size=size, quality=quality(64)) as session:
        radiance = session.render(frame_of(view)).radiance
    distance = -ground_points(view, size)[..., 1]
    clear = (distance > 0.03).all(axis=1)
    share = 0.5 * (1 + distance / np.hypot(distance, height))
    assert_agree(radiance[clear], 0.6 * share[clear])
    assert np.ptp(share[clear]) > 0.2


def test_next_to_a_high_wall_half_of_the_sky_is_left():
    wall = box((-5000, 0, 0), (5000, 0.1, 5000.0))
    parts = [static("ground", plane(6000), "g"), static("wall", wall, "black")]
    scene = scene_of(parts, {"g": diffuse(0.6), "black": diffuse(0.0)})
    with session_of(scene, size=(32, 32), quality=quality(64)) as session:
        radiance = session.render(frame_of(down(4.0, at=(0.0, -4.0)))).radiance
    assert_agree(radiance, np.full((32, 32), 0.3), rounding=0.004)


# Cavities -----------------------------------------------------------------------------------


@pytest.mark.parametrize("sampled", SAMPLED)
@pytest.mark.parametrize(("albedo", "depth"), [(0.2, 4), (0.5, 2), (0.85, 3), (0.85, 8)])
def test_a_closed_cavity_sums_the_geometric_series(albedo, depth, sampled):
    """Walls that shine with 1 and reflect rho show 1 + rho + rho^2 + ..., in any shape.

    `max_depth` counts segments: n of them carry n - 1 reflections.
    """
    room = box((-3, -2, -1), (4, 2, 3))
    inside = Mesh(room.vertices, room.faces[:, ::-1])
    lamps = LampSet(
        "walls", "signals", inside, [0] * len(inside.faces), ("walls",), sampled=sampled
    )
    scene = scene_of([], {"signal_lens": diffuse(albedo)}, sky=constant_sky(0.0), lamps=[lamps])
    view = view_at([0.3, 0.2, 0.4], pitch=-20, heading=30)
    with session_of(scene, size=(24, 24), quality=quality(64, max_depth=depth)) as session:
        frame = frame_of(view, lamps={"walls": np.ones((1, 3))})
        radiance = session.render(frame).radiance
    assert_agree(radiance, np.full((24, 24), (albedo ** np.arange(depth)).sum()))


@pytest.mark.parametrize("albedo", [0.3, 0.8])
def test_an_integrating_sphere(albedo):
    """Light through a window of share f: L = rho f / (1 - rho (1 - f)) on every wall.

    In a sphere every spot sees every other of one size alike.
    """
    whole = ball((0, 0, 0), 2.0, rows=64, columns=96)
    middles = whole.vertices[whole.faces].mean(axis=1)
    open_ = middles[:, 2] > 1.2
    corners = whole.vertices[whole.faces]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    share = areas[open_].sum() / areas.sum()
    shell = Mesh(whole.vertices, whole.faces[~open_])
    scene = scene_of([static("s", shell, "m")], {"m": two_sided(diffuse(albedo))})
    with session_of(scene, size=(32, 32), quality=quality(128, max_depth=60)) as session:
        view = view_at([0.0, 0.0, 0.0], pitch=-50, fov=80)
        radiance = session.render(frame_of(view)).radiance
    known = albedo * share / (1 - albedo * (1 - share))
    assert 0.1 < share < 0.3
    # The mesh is a little smaller than the sphere.
    assert_agree(radiance, np.full((32, 32), known), rounding=0.01)


def test_two_parallel_planes_of_which_one_shines():
    """A grey ceiling that shines with 1 over a matt floor."""
    floor, ceiling = plane(400), plane(400, z=2.0)
    ceiling = Mesh(ceiling.vertices, ceiling.faces[:, ::-1])
    lamps = LampSet("c", "signals", ceiling, [0, 0], ("c",))
    materials = {"g": diffuse(0.5), "signal_lens": diffuse(0.4)}
    scene = scene_of([static("g", floor, "g")], materials, sky=constant_sky(0.0), lamps=[lamps])
    with session_of(scene, size=(32, 32), quality=quality(128, max_depth=40)) as session:
        frame = frame_of(view_at([0, 0, 1.0], pitch=-90, fov=60), lamps={"c": np.ones((1, 3))})
        radiance = session.render(frame).radiance
    # Floor = rho_f x ceiling, ceiling = 1 + rho_c x floor.
    assert_agree(radiance, np.full((32, 32), 0.5 / (1 - 0.5 * 0.4)), rounding=0.01)


# The sun ------------------------------------------------------------------------------------


def sun_at(azimuth, elevation):
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])


def tilted(normal, centre, half=1.0):
    """A square with a given normal."""
    side = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(normal, side)
    corners = [
        centre + half * (a * side + b * other) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize("elevation", [8, 30, 65])
def test_the_sun_on_tilted_planes_follows_the_cosine_law(elevation):
    """Radiance = albedo / pi x (sun x cosine + what the sky's map sends)."""
    from sumo3dviz_pt.render.sky.daylight import directions

    sun = sun_at(140, elevation)
    tilts = [(0, 0), (30, 140), (60, 140), (42, 320), (55, 50), (75, 230)]
    normals = [sun_at(azimuth, 90 - tilt) for tilt, azimuth in tilts]
    places = [np.array([0.0, 0.0, 100.0 * k]) for k in range(len(tilts))]
    parts = [
        static(f"p{k}", tilted(n, place), "grey")
        for k, (n, place) in enumerate(zip(normals, places, strict=True))
    ]
    scene = scene_of(parts, {"grey": diffuse(0.5)}, sky=Sky(sun))
    lit = []
    with session_of(scene, size=(16, 16), quality=quality(256)) as session:
        baked = session.sky
        for (tilt, azimuth), normal, place in zip(tilts, normals, places, strict=True):
            eye = place + 4.0 * normal
            view = view_at(eye, heading=azimuth + 180, pitch=tilt - 90, fov=20)
            radiance = session.render(frame_of(view)).radiance.astype(np.float64)
            lit.append(
                (radiance.mean(axis=(0, 1)), standard_error(radiance.reshape(-1, 3), axis=0))
            )
    towards = directions(baked.radiance.shape[:2])
    rows, columns = towards.shape[:2]
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    solid = np.sin(theta)[:, None] * (np.pi / rows) * (2 * np.pi / columns)
    for normal, (mean, error) in zip(normals, lit, strict=True):
        weight = solid * np.maximum(towards @ normal, 0.0)
        air = np.einsum("hwc,hw->c", baked.radiance.astype(np.float64), weight)
        known = 0.5 / np.pi * (air + baked.sun.irradiance * max(normal @ sun, 0.0))
        assert (np.abs(mean - known) <= ROUNDING * known + sidak_z(18) * error).all()


@pytest.mark.parametrize(("elevation", "height"), [(90, 20.0), (90, 4.0), (35, 6.0)])
def test_the_penumbra_is_as_wide_as_the_sun(elevation, height):
    """Behind an edge the lit share of the disc is (x sqrt(1 - x^2) + asin x) / pi + 1/2.

    The edge runs towards the sun, so that across it the penumbra is that of the slanted
    distance, whatever the elevation.
    """
    distance = height / np.sin(np.radians(elevation))
    radius = distance * np.tan(SUN_RADIUS)
    roof = Mesh(
        np.array([[0, -300, height], [300, -300, height], [300, 300, height], [0, 300, height]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    parts = [static("g", plane(400), "g"), static("roof", roof, "black")]
    scene = scene_of(
        parts, {"g": diffuse(0.5), "black": two_sided(diffuse(0.0))}, sky=Sky(sun_at(0, elevation))
    )
    size = (64, 16)
    eye = 1.5
    fov = float(np.degrees(2 * np.arctan(2.0 * radius / eye)))
    view = down(eye, fov=fov)
    with session_of(scene, size=size, quality=quality(1024)) as session:
        radiance = session.render(frame_of(view)).radiance.astype(np.float64)
    green = radiance[..., 1].mean(axis=0)
    east = ground_points(view, size)[0, :, 0] / radius
    x = np.clip(-east, -1.0, 1.0)
    share = 0.5 + (x * np.sqrt(1 - x**2) + np.arcsin(x)) / np.pi
    # The sky is half hidden everywhere here: a level and a slope, fitted with the sun's height.
    model = np.stack([share, np.ones_like(share), east], axis=1)
    found, *_ = np.linalg.lstsq(model, green, rcond=None)
    error = standard_error(radiance[..., 1], axis=0) / found[0]
    residual = (green - model @ found) / found[0]
    assert (
        np.abs(residual).max()
        < sidak_z(len(east)) * np.maximum(error, np.median(error)).max() + 0.01
    )
    # Its width, free: the best radius lies within 3 % of the sun's.
    widths = np.linspace(0.8, 1.2, 81)
    misfits = []
    for width in widths:
        x = np.clip(-east / width, -1.0, 1.0)
        model[:, 0] = 0.5 + (x * np.sqrt(1 - x**2) + np.arcsin(x)) / np.pi
        misfits.append(np.linalg.lstsq(model, green, rcond=None)[1][0])
    assert widths[np.argmin(misfits)] == pytest.approx(1.0, abs=0.03)


# Mirrors ------------------------------------------------------------------------------------


def spotted_sky(azimuth, elevation, *, size=(128, 256), radius=2.0):
    """A dim sky with one bright spot."""
    rows, columns = np.mgrid[: size[0], : size[1]]
    theta = (rows + 0.5) / size[0] * np.pi
    phi = (columns + 0.5) / size[1] * 2 * np.pi
    towards = np.stack(
        [np.sin(theta) * np.sin(phi), np.sin(theta) * np.cos(phi), np.cos(theta)], axis=-1
    )
    near = np.arccos(np.clip(towards @ sun_at(azimuth, elevation), -1, 1)) < np.radians(radius)
    image = np.full((*size, 3), 0.01, dtype=np.float32)
    image[near] = 50.0
    return Sky(None, image=image)


def centroid(radiance, view):
    """Direction of the brightest part of a picture, (3,)."""
    light = radiance.mean(axis=-1)
    light = np.where(light > 0.5 * light.max(), light, 0.0)
    half, (rows, columns) = view.lens.half_width, np.indices(light.shape)
    left = (1 - 2 * (columns + 0.5) / light.shape[1]) * half
    up = (1 - 2 * (rows + 0.5) / light.shape[0]) * half * light.shape[0] / light.shape[1]
    rays = np.stack([np.ones_like(left), left, up], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    mean = (rays * light[..., None]).sum(axis=(0, 1))
    return view.world_from_camera.matrix[:3, :3] @ (mean / np.linalg.norm(mean))


@pytest.mark.parametrize(("azimuth", "elevation"), [(20, 50), (200, 35), (310, 60)])
@pytest.mark.parametrize("material", ["mirror", "chrome"])
def test_a_level_mirror_shows_the_sky_upside_down(material, azimuth, elevation):
    mirror = {"type": "conductor", "material": "none"}
    scene = scene_of(
        [static("m", plane(50), "m")],
        {"m": mirror if material == "mirror" else MATERIALS["chrome"]},
        sky=spotted_sky(azimuth, elevation),
    )
    view = view_at([0, 0, 3], heading=azimuth + 4, pitch=-elevation + 3, fov=40)
    with session_of(scene, size=(64, 64), quality=quality(64)) as session:
        radiance = session.render(frame_of(view)).radiance.astype(np.float64)
    seen = centroid(radiance, view) * [1, 1, -1]
    off = np.degrees(np.arccos(np.clip(seen @ sun_at(azimuth, elevation), -1, 1)))
    # Chrome is rough: its lobe leans a little to grazing directions.
    assert off < (0.4 if material == "mirror" else 1.5)
    if material == "mirror":
        assert radiance.max() == pytest.approx(50.0, rel=1e-3)


def test_a_wall_of_mirror_shows_what_is_behind_the_camera():
    wall = box((-30, 10, -30), (30, 10.1, 30))
    scene = scene_of(
        [static("m", wall, "m")],
        {"m": {"type": "conductor", "material": "none"}},
        sky=spotted_sky(160, 12),
    )
    view = view_at([0, 0, 0], heading=0, fov=60)
    with session_of(scene, size=(64, 64), quality=quality(64)) as session:
        radiance = session.render(frame_of(view)).radiance
    seen = centroid(radiance, view) * [1, -1, 1]
    assert np.degrees(np.arccos(np.clip(seen @ sun_at(160, 12), -1, 1))) < 0.4


# Lamps --------------------------------------------------------------------------------------


def lamp_at(height, half):
    """A square lamp that shines down."""
    square = plane(half, z=height)
    return Mesh(square.vertices, square.faces[:, ::-1])


def corner_factor(a, b):
    """Of a rectangle a x b at distance 1 over its corner, parallel to the element (C-3)."""
    first = a / np.hypot(1, a) * np.arctan2(b, np.hypot(1, a))
    second = b / np.hypot(1, b) * np.arctan2(a, np.hypot(1, b))
    return (first + second) / (2 * np.pi)


def square_factor(points, height, half):
    """Configuration factor of the lamp at points of the ground, (...)."""
    x, y = points[..., 0] / height, points[..., 1] / height
    h = half / height
    total = 0.0
    for sx, ex in ((1, x + h), (-1, x - h)):
        for sy, ey in ((1, y + h), (-1, y - h)):
            value = corner_factor(np.abs(ex), np.abs(ey)) * np.sign(ex) * np.sign(ey)
            total = total + sx * sy * value
    return total


@pytest.mark.parametrize("sampled", SAMPLED)
@pytest.mark.parametrize(("height", "half"), [(2.0, 1.0), (5.0, 2.5)])
def test_a_square_lamp_lights_the_ground_by_its_form_factor(sampled, height, half):
    """Whether paths aim at it or find it by chance."""
    lamps = LampSet("l", "street", lamp_at(height, half), [0, 0], ("l",), sampled=sampled)
    materials = {"g": diffuse(0.5), "signal_lens": diffuse(0.0)}
    scene = scene_of([static("g", plane(50), "g")], materials, sky=constant_sky(0.0), lamps=[lamps])
    size = (40, 40)
    view = down(height - 0.1, fov=110)
    with session_of(scene, size=size, quality=quality(64 if sampled else 256)) as session:
        frame = frame_of(view, lamps={"l": np.full((1, 3), 7.0)})
        radiance = session.render(frame).radiance
    points = ground_points(view, size)
    assert_agree(radiance, 7.0 * 0.5 * square_factor(points, height, half))


@pytest.mark.parametrize("sampled", SAMPLED[1:])
@pytest.mark.parametrize("distance", [4.0, 32.0])
def test_a_far_lamp_follows_the_inverse_square(distance, sampled):
    """E = L A cos cos' / d^2, under it and 45 degrees beside it."""
    half = 0.1
    lamps = LampSet("l", "street", lamp_at(distance, half), [0, 0], ("l",), sampled=sampled)
    materials = {"g": diffuse(0.5), "signal_lens": diffuse(0.0)}
    scene = scene_of(
        [static("g", plane(100), "g")], materials, sky=constant_sky(0.0), lamps=[lamps]
    )
    with session_of(scene, size=(8, 8), quality=quality(64)) as session:
        for beside, cosine in ((0.0, 1.0), (distance, np.sqrt(0.5))):
            view = down(1.0, at=(beside, 0.0), fov=2)
            frame = frame_of(view, lamps={"l": np.full((1, 3), 300.0)})
            radiance = session.render(frame).radiance
            known = 0.5 / np.pi * 300.0 * (2 * half) ** 2 * cosine**4 / distance**2
            assert_agree(radiance, np.full((8, 8), known), rounding=0.005)
