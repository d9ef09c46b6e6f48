"""No material makes light, known scenes give known radiance, and noise falls as it must."""

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

from sumo3dviz_pt.image.metrics import capped_rmse
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.model.scene import Sky

NAMES = tuple(sorted(MATERIALS))
SPACING, RADIUS = 3.0, 1.0
PER_ROW = int(np.ceil(np.sqrt(1.4 * len(NAMES)))) + 1


def spot(index):
    """Centre of a material's ball [m]; the balls face a camera high above."""
    return np.array([SPACING * (index % PER_ROW), SPACING * (index // PER_ROW), 0.0])


def whitened(bsdf):
    """The same material in the brightest colour that the house rule allows."""
    white = {"type": "rgb", "value": [0.85] * 3}
    if "bsdf" in bsdf:
        return {**bsdf, "bsdf": whitened(bsdf["bsdf"])}
    return {key: white if key in ("base_color", "reflectance") else v for key, v in bsdf.items()}


@pytest.fixture(scope="module", params=["own", "white"])
def furnace(request):
    """Radiance of every material's ball in a closed white sky, by name."""
    white = request.param == "white"
    materials = {n: whitened(b) if white else b for n, b in MATERIALS.items()}
    parts = [
        static(n, ball(spot(k), RADIUS), n, np.full((len(ball(spot(k), RADIUS).faces), 3), 0.85))
        for k, n in enumerate(NAMES)
    ]
    wide, deep = PER_ROW - 1, (len(NAMES) - 1) // PER_ROW
    middle = (SPACING * wide / 2, SPACING * deep / 2, 5.7 * PER_ROW)
    quality = RAW.model_copy(update={"spp": 128, "pass_spp": 64, "max_depth": 16})
    size = (24 * PER_ROW, 120 * PER_ROW // 7)
    view = view_at(middle, pitch=-90, fov=35)
    with session_of(scene_of(parts, materials), size=size, quality=quality) as session:
        image = session.render(frame_of(view)).radiance
    camera = view.world_from_camera.matrix[:3, :3]
    half = view.lens.half_width
    rows, columns = np.mgrid[: size[1], : size[0]]
    x = (1 - 2 * (columns + 0.5) / size[0]) * half
    y = (1 - 2 * (rows + 0.5) / size[1]) * half * size[1] / size[0]
    found = {}
    for k, name in enumerate(NAMES):
        ahead, left, up = (spot(k) - view.position) @ camera
        inside = np.hypot(x - left / ahead, y - up / ahead) < 0.9 * RADIUS / ahead
        assert inside.sum() > 20
        found[name] = image[inside]
    return request.param, found, image


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_white_furnace(furnace, name):
    kind, found, _ = furnace
    pixels = found[name].astype(np.float64)
    error = pixels.std(axis=0) / np.sqrt(len(pixels))
    assert (pixels.mean(axis=0) <= 1.02 + 3 * error).all()
    assert pixels.min() >= 0
    if kind == "white":
        assert pixels.mean() > 0.5, "a white material that swallows half the light is suspicious"


@pytest.mark.slow
def test_the_furnaces_sky_is_one(furnace):
    _, _, image = furnace
    np.testing.assert_allclose(image[0, 0], 1.0, rtol=1e-5)


@pytest.mark.parametrize("albedo", [0.0, 0.18, 0.5, 0.85])
def test_a_matt_plane_under_a_white_sky_shows_its_albedo(albedo):
    scene = scene_of([static("g", plane(200), "g")], {"g": diffuse(albedo)})
    with session_of(scene) as session:
        image = session.render(frame_of(view_at([0, 0, 10], pitch=-60))).radiance
    error = image.std() / np.sqrt(image.size / 3)
    assert abs(image.mean() - albedo) < 0.002 + 4 * error


def test_radiance_is_linear_in_the_sky():
    parts, materials = [static("g", plane(200), "g")], {"g": diffuse(0.4)}
    means = []
    for radiance in (1.0, 7.0):
        with session_of(scene_of(parts, materials, sky=constant_sky(radiance))) as session:
            means.append(session.render(frame_of(view_at([0, 0, 10], pitch=-60))).radiance)
    np.testing.assert_allclose(means[1], 7 * means[0], rtol=1e-3)


# Noise --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def street():
    """A shaded scene with a gloss: passes of any number of samples and seed."""
    parts = [
        static("g", plane(60), "grey"),
        static("b", box((-2, 10, 0), (2, 13, 3)), "red"),
        static("c", ball((4, 9, 1), 1.0), "paint", np.full((3968, 3), 0.4)),
    ]
    materials = {
        "grey": diffuse(0.4),
        "red": diffuse(0.7, 0.1, 0.1),
        "paint": MATERIALS["paint"],
    }
    sky = np.full((32, 64, 3), 0.3, dtype=np.float32)
    sky[6:10, 10:18] = 12.0
    scene = scene_of(parts, materials, sky=Sky(None, image=sky))
    view = view_at([0, 0, 2.5], pitch=-8)

    def render(spp, seed):
        quality = RAW.model_copy(update={"spp": spp, "pass_spp": min(spp, 64)})
        with session_of(scene, size=(80, 45), quality=quality, seed=seed) as session:
            return session.render(frame_of(view)).radiance

    return render


@pytest.mark.slow
def test_two_seeds_agree_in_the_mean(street):
    """z-test over 15 x 16 blocks; Sidak-corrected for 240 of them."""
    stacks = []
    for first in (100, 200):
        runs = [street(16, first + n) for n in range(6)]
        blocks = [r.reshape(15, 3, 16, 5, 3).mean(axis=(1, 3, 4)) for r in runs]
        stacks.append(np.array(blocks, dtype=np.float64))
    spread = np.sqrt(sum(s.var(axis=0, ddof=1) / len(s) for s in stacks))
    t = (stacks[0].mean(axis=0) - stacks[1].mean(axis=0)) / np.maximum(spread, 1e-4)
    # Student's t with 10 degrees of freedom: P(|t| > 6.5) x 240 = 1.7 %.
    assert np.abs(t).max() < 6.5
    assert abs(t.mean()) < 0.5


@pytest.mark.slow
def test_noise_falls_with_the_root_of_the_samples(street):
    reference = street(2048, 99)
    counts = [1, 4, 16, 64]
    errors = [
        np.sqrt(np.mean([capped_rmse(street(n, seed), reference, cap=4.0) ** 2 for seed in (1, 2)]))
        for n in counts
    ]
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert -0.75 <= slope <= -0.4, (slope, errors)
