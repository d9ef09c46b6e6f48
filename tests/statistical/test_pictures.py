"""Small pictures of known scenes: directions, colours, shadows, lamps."""

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    RAW,
    ball,
    box,
    constant_sky,
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

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.library.materials import MATERIALS, matt
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Haze, LampSet, Sky, Slots

RED, GREEN, BLUE = (0.7, 0.05, 0.05), (0.05, 0.7, 0.05), (0.05, 0.05, 0.7)
COLOURS = {"red": RED, "green": GREEN, "blue": BLUE}
MATT_TINT = matt({"type": "tint"})
SKY = (1.0, 1.0, 1.0)


def pixel_of(view, point, size):
    """Row and column where a world point falls, by the pinhole's formula."""
    camera = (np.asarray(point) - view.position) @ view.world_from_camera.matrix[:3, :3]
    half = view.lens.half_width
    x, y = camera[1] / camera[0] / half, camera[2] / camera[0] / (half * size[1] / size[0])
    return int((1 - y) / 2 * size[1]), int((1 - x) / 2 * size[0])


def hue(colour):
    """Name of the channel that leads clearly, or None."""
    names = ("red", "green", "blue")
    order = np.argsort(colour)
    return names[order[-1]] if colour[order[-1]] > 2 * colour[order[-2]] else None


# The camera --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def landmarks():
    """A red box in the north, green in the west, blue in the south."""
    places = {"red": (0, 40, 0), "green": (-40, 0, 0), "blue": (0, -40, 0)}
    parts = [
        static(name, box(np.add(place, (-2, -2, -2)), np.add(place, (2, 2, 2))), name)
        for name, place in places.items()
    ]
    materials = {name: diffuse(*colour) for name, colour in COLOURS.items()}
    with session_of(scene_of(parts, materials)) as session:
        yield session


@pytest.mark.parametrize(
    ("heading", "column", "expected"),
    [
        (0, 32, "red"),
        (180, 32, "blue"),
        (270, 32, "green"),
        (90, 32, None),
        (20, 12, "red"),  # the north lies to the left when one looks east of it
        (-20, 51, "red"),
        (290, 12, "green"),
        (200, 12, "blue"),
    ],
)
def test_compass(landmarks, heading, column, expected):
    radiance = landmarks.render(frame_of(view_at([0, 0, 0], heading=heading))).radiance
    assert hue(radiance[18, column]) == expected


def test_pitch_and_roll(landmarks):
    up = landmarks.render(frame_of(view_at([0, 0, 0], pitch=10))).radiance
    assert hue(up[18, 32]) is None and hue(up[28, 32]) == "red"


def test_field_of_view_is_horizontal(landmarks):
    """The box is 4 m wide, its face 38 m away."""
    for fov in (20, 60, 120):
        radiance = landmarks.render(frame_of(view_at([0, 0, 0], fov=fov))).radiance
        width = sum(hue(pixel) == "red" for pixel in radiance[18])
        expected = 64 * (2 / 38) / np.tan(np.radians(fov / 2))
        assert abs(width - expected) <= 1.5


def test_an_eye_on_another_grid_cell_sees_the_same(landmarks):
    """The renderer recentres; the scene must follow."""
    far = view_at([0, -900, 0], fov=8)
    frame = frame_of(far)
    assert np.abs(frame.origin).max() == 1000
    radiance = landmarks.render(frame).radiance
    assert hue(radiance[18, 32]) == "blue"
    near = landmarks.render(frame_of(view_at([0, 0, 0]))).radiance
    assert hue(near[18, 32]) == "red"


# The sun -----------------------------------------------------------------------------------


@pytest.mark.parametrize("azimuth", [90, 200])
def test_shadows_fall_away_from_the_sun(azimuth):
    a, e = np.radians(azimuth), np.radians(35)
    sun = np.array([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])
    parts = [static("ground", plane(40), "grey"), static("post", box((-1, -1, 0), (1, 1, 6)), "k")]
    scene = scene_of(parts, {"grey": diffuse(0.5), "k": diffuse(0.02)}, sky=Sky(sun))
    view = view_at([0, 0, 40], pitch=-90, fov=60)
    size = (64, 64)
    with session_of(scene, size=size, quality=RAW.model_copy(update={"spp": 16})) as session:
        ground = session.render(frame_of(view)).radiance.mean(axis=-1)
        sky = session.sky
    tip = -5.0 * sun[:2] / np.hypot(*sun[:2])
    shaded = ground[pixel_of(view, [*tip, 0], size)]
    lit = ground[pixel_of(view, [*-tip, 0], size)]
    assert shaded < 0.45 * lit
    # A lit matt plane returns albedo / pi of what falls on it.
    light = sky.illuminance / 32_000.0
    corners = [image.mean() for image in (ground[:8, :8], ground[:8, -8:], ground[-8:, :8])]
    assert np.mean(corners) == pytest.approx(0.5 / np.pi * light, rel=0.06)


# Movers ------------------------------------------------------------------------------------

PLACES = [(20.0, 8.0, 0.0), (20.0, 0.0, 0.0), (20.0, -8.0, 0.0)]


def fleet_scene(**slots):
    return scene_of(
        [static("ground", plane(60, z=-0.5), "black")],
        {"matt_tint": MATT_TINT, "black": diffuse(0.02)},
        prototypes=[cube()],
        slots=Slots(**slots),
    )


def seen(session, frame):
    radiance = session.render(frame).radiance
    spots = [np.add(place, (-0.9, 0, 1)) for place in PLACES]
    return [hue(radiance[pixel_of(frame.view, spot, session.settings.size)]) for spot in spots]


EYE = view_at([0, 0, 3], heading=90, pitch=-6)
DENOISERS = ("fast", "balanced", "high")


@pytest.fixture(scope="module", params=["near", "far", "near path", "far path"])
def road(request):
    """Three cubes in detail, or as stand-ins, by our own kernel or by Mitsuba's path tracer."""
    far = request.param.startswith("far")
    slots = {"far": {"cube": 3}} if far else {"near": {"cube": 3}}
    tracer = "path" if request.param.endswith("path") else "kernel"
    quality = RAW.model_copy(update={"tracer": tracer})
    with session_of(fleet_scene(**slots), quality=quality) as session:
        yield session, far


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 0, 2), (0, 1, 2)])
def test_every_body_shows_its_own_colour(road, order):
    session, far = road
    names = [list(COLOURS)[k] for k in order]
    movers = [
        mover(f"vehicle:{n}", place, COLOURS[name])
        for n, (place, name) in enumerate(zip(PLACES, names, strict=True))
    ]
    frame = frame_of(EYE, **{"far" if far else "movers": movers})
    assert seen(session, frame) == names


def test_free_slots_are_out_of_sight(road):
    session, far = road
    one = [mover("vehicle:0", PLACES[1], RED)]
    assert seen(session, frame_of(EYE, **{"far" if far else "movers": one})) == [
        None,
        "red",
        None,
    ]
    assert seen(session, frame_of(EYE)) == [None, None, None]


def test_too_many_bodies_are_an_error(road):
    session, far = road
    crowd = [mover(f"vehicle:{n}", PLACES[0], RED) for n in range(4)]
    with pytest.raises(RenderError, match=r"slot is free for vehicle:\d \(cube\)"):
        session.render(frame_of(EYE, **{"far" if far else "movers": crowd}))


def test_bodies_point_forward(road):
    """A cube's origin is its front: it extends backwards, whatever the yaw."""
    session, far = road
    size = session.settings.size
    view = view_at([0, 0, 60], pitch=-89.99, fov=60)
    for yaw in (0.0, 0.5 * np.pi, 2.2):
        body = [mover("vehicle:0", (0.0, 0.0, 0.0), RED, yaw=yaw)]
        image = session.render(frame_of(view, **{"far" if far else "movers": body})).radiance
        back = -4.0 * np.array([np.cos(yaw), np.sin(yaw)]) / 4.0
        assert hue(image[pixel_of(view, [*back, 2.0], size)]) == "red"
        assert hue(image[pixel_of(view, [*(-2.5 * back), 0.0], size)]) is None


# Lamps -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def lamps():
    """Two lamps of two triangles each in the north."""
    left, right = (
        Mesh(
            np.array([[x, 20, 0], [x + 2, 20, 0], [x + 2, 20, 2], [x, 20, 2]]),
            np.array([[0, 1, 2], [0, 2, 3]]),
        )
        for x in (-4.0, 2.0)
    )
    mesh = Mesh(
        np.concatenate([left.vertices, right.vertices]),
        np.concatenate([left.faces, right.faces + 4]),
    )
    lamp_set = LampSet("signals", "signals", mesh, [0, 0, 1, 1], ("J/0/red", "J/0/green"))
    scene = scene_of(
        [],
        {"signal_lens": MATERIALS["signal_lens"]},
        sky=constant_sky(0.0),
        lamps=[lamp_set],
    )
    with session_of(scene) as session:
        yield session


@pytest.mark.parametrize(
    ("radiance", "left", "right"),
    [
        ([[5, 0, 0], [0, 0, 0]], "red", None),
        ([[0, 0, 0], [0, 7, 0]], None, "green"),
        ([[5, 0, 0], [0, 7, 0]], "red", "green"),
    ],
)
@pytest.mark.parametrize("shift", [0.0, -380.0])
@pytest.mark.parametrize("again", [0, 1])
def test_lamps_shine_as_told(lamps, radiance, left, right, shift, again):
    """In every frame of a film's recording, and from another cell of the renderer's grid."""
    view = view_at([0, shift, 1], fov=2 * np.degrees(np.arctan(8 / (20 - shift))))
    values = np.array(radiance, dtype=float)
    image = lamps.render(frame_of(view, lamps={"signals": values})).radiance
    spots = [pixel_of(view, (x, 20, 1), (64, 36)) for x in (-3, 3)]
    assert [hue(image[spot]) for spot in spots] == [left, right]
    for spot, expected in zip(spots, values, strict=True):
        np.testing.assert_allclose(image[spot], expected, rtol=1e-3, atol=1e-6)


# What a frame's passes report ---------------------------------------------------------------


def test_haze_veils_far_things_and_spares_the_sky():
    parts = [static("wall", box((-400, 1500, -50), (0, 1510, 400)), "black")]
    scene = scene_of(parts, {"black": diffuse(0.0)}, haze=Haze())
    quality = Quality(spp=4, pass_spp=4, max_depth=4, denoise="none", cap=None, haze=True)
    with session_of(scene, quality=quality) as session:
        image = session.render(frame_of(view_at([0, 0, 1]))).radiance
    veil = 1 - np.exp(-1500 * np.array(Haze().extinction))
    np.testing.assert_allclose(image[10, 20], veil, rtol=0.05)
    np.testing.assert_allclose(image[10, 50], 1.0, rtol=1e-3)


def test_the_cap_spares_what_is_seen_directly_and_says_what_it_took():
    """A mirror ball under a small bright sky patch would be a nest of fireflies."""
    sky = np.full((16, 32, 3), 0.2, dtype=np.float32)
    sky[4, 8] = 3000.0
    ground = static("ground", plane(40), "grey")
    glossy = static("ball", ball((0, 12, 1.5), 1.5), "chrome")
    scene = scene_of(
        [ground, glossy],
        {"grey": diffuse(0.5), "chrome": MATERIALS["chrome"]},
        sky=Sky(None, image=sky),
    )
    quality = Quality(spp=4, pass_spp=2, max_depth=6, denoise="none", cap=40.0, haze=False)
    with session_of(scene, quality=quality) as session:
        rendered = session.render(frame_of(view_at([0, 0, 2])))
        assert rendered.tally.passes == 2
        above = session.render(frame_of(view_at([0, 0, 2], heading=95, pitch=40))).radiance
    assert rendered.radiance.max() <= 40.0 * (1 + 1e-5) or rendered.tally.capped == 0
    assert above.max() > 100, "the sky itself is not capped"


@pytest.mark.parametrize(
    "denoise", [pytest.param(n, marks=[pytest.mark.slow] * (n != "fast")) for n in DENOISERS]
)
def test_denoisers_keep_the_mean_and_guides_help(denoise):
    parts = [static("g", plane(40), "grey"), static("b", box((-1, 9, 0), (1, 11, 2)), "red")]
    scene = scene_of(parts, {"grey": diffuse(0.5), "red": diffuse(*RED)})
    guides = denoise == "high"
    quality = Quality(spp=4, pass_spp=4, max_depth=4, denoise=denoise, guides=guides, haze=False)
    passes = []
    with session_of(scene, quality=quality) as session:
        rendered = session.render(
            frame_of(view_at([0, 0, 2], pitch=-10)), after_pass=lambda *event: passes.append(event)
        )
    assert passes == [(1, 1)]
    image = rendered.radiance
    assert (image >= 0).all() and np.isfinite(image).all()
    assert image[-8:].mean() == pytest.approx(0.5, rel=0.06)
    assert {"load", "update", "render", "denoise"} <= set(rendered.cpu)


def test_the_sky_is_not_denoised_and_textures_keep_their_share():
    sky = np.random.default_rng(1).uniform(0.2, 1.0, (64, 128, 3)).astype(np.float32)
    ground = [static("g", plane(400), "grey")]
    scene = scene_of(ground, {"grey": diffuse(0.5)}, sky=Sky(None, image=sky))
    frame = frame_of(view_at([0, 0, 2]))
    quality = Quality(spp=4, pass_spp=4, max_depth=4, denoise="fast", haze=False, cap=None)
    pictures = {}
    with session_of(scene, quality=quality) as session:
        for share in (0.0, 1.0):
            session.retune(quality.model_copy(update={"raw_share": share}), seed=1)
            samples = session.samples(frame)
            pictures[share] = session.finish(samples, frame)
        raw = session.finish(samples, frame, denoiser="none")
    above = samples.layers["hit"] == 0
    assert 0.3 < above.mean() < 0.6
    for picture in pictures.values():
        np.testing.assert_allclose(picture[above], raw[above], rtol=1e-5)
    errors = {share: np.abs(pictures[share] - raw)[~above].mean() for share in pictures}
    assert 0.01 < errors[1.0] < errors[0.0]


@pytest.mark.parametrize("tracer", ["kernel", "path"])
def test_layers_beside_the_picture_show_what_is_seen(tmp_path, tracer):
    """Straight down on a grey, level ground, all of them are known; EXR files keep their names."""
    import OpenEXR

    scene = scene_of([static("g", plane(40), "grey")], {"grey": diffuse(0.5)})
    quality = Quality(
        spp=16, pass_spp=16, max_depth=2, denoise="fast", guides=True, haze=False, tracer=tracer
    )
    wanted = ("radiance", "depth", "hit", "albedo", "normal")
    with session_of(scene, quality=quality) as session:
        session.settings = replace(session.settings, layers=wanted)
        layers = session.render(frame_of(view_at([0, 0, 10], pitch=-90, fov=2))).layers
    assert tuple(layers) == wanted and layers.size == (64, 36)
    np.testing.assert_allclose(layers["depth"], 10.0, rtol=1e-3)
    np.testing.assert_array_equal(layers["hit"], 1.0)
    np.testing.assert_allclose(layers["albedo"], 0.5, rtol=1e-3)
    np.testing.assert_allclose(layers["normal"] - [0.0, 0.0, 1.0], 0.0, atol=1e-3)
    write_exr(tmp_path / "a.exr", layers)
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert set(file.channels()) == {"RGB", "depth", "hit", "albedo", "normal"}
