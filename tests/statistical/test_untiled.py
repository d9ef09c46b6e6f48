"""Untiled textures keep mean and variance, and do not repeat with their bitmap."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from builders import RAW, frame_of, plane, scene_of, session_of, static, view_at

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.materials import planar_uvs, surface_bsdf
from sumo3dviz_pt.model.geometry import UNWORN, Mesh
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.convert import plugin
from sumo3dviz_pt.render.textures import PERIOD, PIXEL, register_untiled

pytestmark = pytest.mark.slow

TILES, SIZE = 24, 900
SURFACES = [
    name
    for name in catalog.names("surfaces")
    if catalog.find("surfaces", name).meta["bsdf"].get("base_color", {}).get("type") == "untiled"
]


@pytest.fixture(scope="module", autouse=True)
def variant():
    backend = choose_backend()
    if not backend.jit:
        pytest.skip("scalar variants show the plain bitmap")
    register_untiled()


def word_of(name):
    """The texture of a surface, as built: even and unworn."""
    word = surface_bsdf(catalog.find("surfaces", name))["base_color"]
    return {**word, "uneven": 0.0, "patches": 0.0, "fields": 0.0, "wear": False}


def values_at(word, uv, *, distance=0.0):
    """Brightness at texture coordinates, (n, 2), seen from a distance [m]."""
    texture = mi.load_dict(plugin(word, tint={}))
    si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
    si.uv = mi.Point2f(*(mi.Float(np.ascontiguousarray(c, np.float32)) for c in uv.T))
    si.t, si.wi = mi.Float(distance), mi.Vector3f(0, 0, 1)
    return np.array(texture.eval_3(si), dtype=np.float64).mean(axis=0)


def bitmap_of(word):
    picture = mi.Bitmap(word["filename"]).convert(
        mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False
    )
    return np.array(picture, dtype=np.float64).mean(axis=-1)


def spots(seed=0, count=SIZE * SIZE):
    return np.random.default_rng(seed).uniform(0.0, TILES, (count, 2))


@pytest.mark.parametrize("name", SURFACES)
def test_mean_and_spread_are_the_bitmaps(name):
    word = word_of(name)
    seen, bitmap = values_at(word, spots()), bitmap_of(word)
    assert seen.mean() == pytest.approx(bitmap.mean(), rel=0.02)
    assert seen.var() == pytest.approx(bitmap.var(), rel=0.02)


@pytest.mark.parametrize("name", SURFACES)
def test_nothing_returns_after_a_tile(name):
    word, uv = word_of(name), spots(count=100_000)
    here = values_at(word, uv)
    # Slabs stay whole: they return along their course; across, only joints of courses do.
    along = () if word.get("regular") else ((1.0, 0.0), (2.0, 0.0))
    most = 0.3 if word.get("regular") else 0.05
    for step in (*along, (0.0, 1.0), (1.0, 1.0), (1.0, 2.0)):
        there = values_at(word, uv + np.array(step))
        assert abs(np.corrcoef(here, there)[0, 1]) < most


def test_far_away_it_fades_to_its_mean():
    word, uv = word_of("asphalt"), spots(count=200_000)
    near, middle, far = (values_at(word, uv, distance=d) for d in (0.0, 60.0, 3000.0))
    assert far.std() < 0.5 * middle.std() < 0.5 * near.std()
    assert far.mean() == pytest.approx(near.mean(), rel=0.02)


def test_a_place_looks_the_same_every_time():
    word, uv = word_of("asphalt"), spots(count=1000)
    assert np.array_equal(values_at(word, uv), values_at(word, uv))


@pytest.mark.parametrize("distance", [20.0, 80.0])
def test_larger_pixels_see_less_of_the_stones(distance):
    word, uv = word_of("asphalt"), spots(count=100_000)
    fine = values_at(word, uv, distance=distance)
    register_untiled(8 * PIXEL)
    coarse = values_at(word, uv, distance=distance)
    register_untiled()
    assert coarse.std() < 0.8 * fine.std()
    assert coarse.mean() == pytest.approx(fine.mean(), rel=0.02)


def test_whole_periods_change_nothing():
    """Far meshes and recentred ones drop whole periods: their roads must not jump there."""
    word = word_of("asphalt")
    # Multiples of 2^-12, so that the shift is exact in single precision.
    uv = np.floor(spots(count=20_000) * 4096.0) / 4096.0
    here, there = values_at(word, uv), values_at(word, uv + np.array([-PERIOD, PERIOD]))
    # Texels are dithered by half a texel and the dice differ, so this is not 1.
    assert np.corrcoef(here, there)[0, 1] > 0.6
    assert np.corrcoef(here, values_at(word, uv + np.array([-PERIOD / 4, 0.0])))[0, 1] < 0.05


def test_a_road_does_not_jump_where_a_flight_crosses_the_grid_of_origins():
    """Three frames of a film; between the last two the renderer takes another origin."""
    road = plane(60.0, centre=(120.0, 40.0))
    uvs = planar_uvs(road.vertices, tile=4.0, near=(0.0, 0.0))
    mesh = Mesh(road.vertices, road.faces, None, uvs, np.tile(UNWORN, (4, 1)))
    bsdf = {"type": "diffuse", "reflectance": word_of("asphalt")}
    quality = RAW.model_copy(update={"spp": 64, "pass_spp": 64, "max_depth": 2})
    pictures = []
    with session_of(
        scene_of([static("road", mesh, "asphalt")], {"asphalt": bsdf}), quality=quality
    ) as session:
        for x in (124.998, 124.999, 125.001):
            view = view_at((x, 30.0, 6.0), pitch=-60.0, fov=25.0)
            pictures.append(session.render(frame_of(view)).radiance.mean(axis=-1))
    assert frame_of(view).origin[0] == 250.0
    inside, across = (np.corrcoef(one.ravel(), pictures[1].ravel())[0, 1] for one in pictures[::2])
    assert inside > 0.6
    assert across > 0.95 * inside
