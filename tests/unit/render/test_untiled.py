"""Pyramids, words and wear of untiled textures, without rendering."""

from itertools import pairwise

import mitsuba as mi
import numpy as np
import pytest

from sumo3dviz_pt.library.materials import surface_material
from sumo3dviz_pt.model.geometry import UNWORN, Mesh, worn_colours
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.convert import make_bsdf, make_mesh, plugin
from sumo3dviz_pt.render.kernels import in_place
from sumo3dviz_pt.render.textures import (
    WEAR_ATTRIBUTE,
    is_worn,
    make_pyramid,
    register_untiled,
    wear_attributes,
)

WORD = {"type": "untiled", "filename": "a.png", "tile": 4.0, "mean": (0.1, 0.2, 0.3), "wear": True}
BSDF = {"type": "principled", "base_color": WORD, "roughness": {**WORD, "roughness": 0.6}}
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def triangle(wear=None):
    rows = None if wear is None else np.tile(wear, (3, 1))
    return Mesh(CORNERS, np.array([[0, 1, 2]]), None, CORNERS[:, :2], rows)


@pytest.fixture
def scalar():
    yield choose_backend("scalar")
    choose_backend()


def test_a_pyramid_keeps_the_mean_at_every_level():
    image = np.random.default_rng(0).random((32, 32, 3))
    pyramid = make_pyramid(image)
    assert pyramid.levels == 3 and len(pyramid.texels) == 32**2 + 16**2 + 8**2
    starts = np.cumsum([0, 32**2, 16**2, 8**2])
    for start, end in pairwise(starts):
        level = pyramid.texels[start:end, :3]
        assert level.mean(axis=0) == pytest.approx(pyramid.mean)
    # Materials read it where it lies.
    assert np.shares_memory(in_place(pyramid.texels, np.float32), pyramid.texels)


@pytest.mark.parametrize("shape", [(24, 24, 3), (16, 32, 3), (4, 4, 3)])
def test_only_squares_with_sides_of_powers_of_two_have_pyramids(shape):
    with pytest.raises(ValueError, match="power of two"):
        make_pyramid(np.zeros(shape))


def test_paint_covers_and_wear_darkens():
    wear = np.array([[1.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]])
    plain, dark, white, yellow = worn_colours(wear, np.array([0.1, 0.1, 0.1]))
    assert plain == pytest.approx([0.1] * 3) and dark == pytest.approx([0.05] * 3)
    assert white.min() > 0.5 and yellow[0] > 3 * yellow[2]


def test_a_scalar_variant_shows_bitmaps_and_colours_of_vertices(scalar):
    plain, worn = (plugin(BSDF, tint={}, worn=flag) for flag in (False, True))
    assert plain["base_color"] == {"type": "bitmap", "filename": "a.png"}
    assert plain["roughness"] == {"type": "uniform", "value": 0.6}
    assert worn["base_color"]["type"] == "mesh_attribute"
    name = worn["base_color"]["name"]
    colours = wear_attributes(BSDF, triangle((0.5, 0.0, 0.0)))[name]
    assert colours == pytest.approx(np.tile([0.05, 0.1, 0.15], (3, 1)))
    assert wear_attributes(BSDF, triangle()) == {}


def test_a_scalar_variant_loads_a_shipped_surface(scalar):
    bsdf = make_bsdf(surface_material("asphalt", textured=True), tint={})
    assert isinstance(bsdf, mi.BSDF)


def test_a_jit_variant_gets_the_wear_of_every_vertex():
    if not choose_backend().jit:
        pytest.skip("needs a JIT variant")
    register_untiled()
    wear = wear_attributes(BSDF, triangle((0.5, 0.2, 0.0)))[WEAR_ATTRIBUTE]
    assert wear == pytest.approx(np.tile([0.5, 0.2, 0.0], (3, 1)))
    assert wear_attributes(BSDF, triangle())[WEAR_ATTRIBUTE] == pytest.approx(
        np.tile(UNWORN, (3, 1))
    )
    assert wear_attributes({"type": "diffuse"}, triangle()) == {}


def test_only_worn_meshes_are_worn():
    assert not is_worn(triangle()) and not is_worn(triangle(UNWORN))
    assert is_worn(triangle((0.9, 0.0, 0.0)))


@pytest.mark.parametrize("width", [1e-1, 1e-3, 1e-5])
def test_slim_triangles_have_a_colour(width, tmp_path):
    """Asphalt's triangulation has some that are 5,000 times longer than wide."""
    if not choose_backend().jit:
        pytest.skip("needs a JIT variant")
    register_untiled()
    pixels = np.full((8, 8, 3), 128, np.uint8)
    mi.Bitmap(pixels).write(str(tmp_path / "grey.png"))
    word = {**WORD, "filename": str(tmp_path / "grey.png")}
    count = 200
    rng = np.random.default_rng(1)
    turn, start = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(-120.0, 120.0, (count, 2))
    along = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    across = along[:, ::-1] * [-1.0, 1.0]
    corners = [start, start + 80.0 * along, start + 40.0 * along + width * across]
    flat = np.stack(corners, axis=1).reshape(-1, 2)
    vertices = np.column_stack([flat, np.zeros(len(flat))])
    wear = np.tile(UNWORN, (len(flat), 1))
    mesh = Mesh(vertices, np.arange(len(flat)).reshape(-1, 3), None, flat, wear)
    bsdf = {"type": "diffuse", "reflectance": word}
    shape = make_mesh(
        "slim", mesh, bsdf=make_bsdf(bsdf, tint={}), attributes=wear_attributes(bsdf, mesh)
    )
    scene = mi.load_dict({"type": "scene", "slim": shape})
    over = np.stack(corners).mean(axis=0)
    rays = mi.Ray3f(mi.Point3f(over[:, 0], over[:, 1], 5.0), mi.Vector3f(0.0, 0.0, -1.0))
    hit = scene.ray_intersect(rays)
    seen = np.array(hit.is_valid())
    # Single precision has steps of 8 micrometres out there.
    assert seen.sum() > (0.9 * count if width > 1e-4 else 20)
    worn = np.array(hit.bsdf().eval(mi.BSDFContext(), hit, mi.Vector3f(0.0, 0.0, 1.0)))
    colour = worn.T[seen] * np.pi
    assert np.isfinite(colour).all()
    np.testing.assert_allclose(colour, colour.mean(), rtol=0.05)
    assert colour.mean() == pytest.approx(0.2159, rel=0.03)
