"""Parts of many plain materials become few meshes."""

from dataclasses import replace

import numpy as np
import pytest
from builders import ball, box, diffuse

from sumo3dviz_pt.library.materials import MATERIALS, coated, matt, principled
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, is_tinted
from sumo3dviz_pt.render.compound import (
    METALLIC_ATTRIBUTE,
    ROUGHNESS_ATTRIBUTE,
    Shades,
    is_plain,
    merged_meshes,
)
from sumo3dviz_pt.render.convert import TINT_ATTRIBUTE, plugin

RED, GREY = (0.8, 0.1, 0.1), (0.2, 0.2, 0.2)
TEXTURE = {"type": "bitmap", "filename": "/a.png"}
TINT = {"type": "tint"}
OWN = {
    "red": principled(RED, roughness=0.3),
    "grey": principled(GREY, roughness=0.6, metallic=1.0),
    "bare": {"type": "principled", "base_color": {"type": "rgb", "value": [0.5, 0.5, 0.5]}},
    "coat": coated(RED, roughness=0.2, under=0.4),
    "road": principled(TEXTURE, roughness=0.9),
    "bumpy": {**principled(RED, roughness=0.2), "roughness": TEXTURE},
    "matt": diffuse(0.5),
    "tint": principled(TINT, roughness=0.4),
    "leaf": matt(TINT),
}
CUBE = box((0, 0, 0), (1, 1, 1))


def part(material, *, mesh=CUBE, tint=None):
    return Part(mesh, material, None if tint is None else np.tile(tint, (len(mesh.faces), 1)))


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("red", True),
        ("grey", True),
        ("bare", True),
        ("tint", True),
        ("coat", False),
        ("road", False),
        ("bumpy", False),
        ("matt", False),
        ("leaf", False),
    ],
)
def test_which_materials_are_plain(name, plain):
    assert is_plain(OWN[name]) is plain


def test_plain_parts_become_one_mesh_with_their_values_by_face():
    (merged,) = merged_meshes(
        [part("red"), part("grey"), part("bare"), part("tint", tint=[0, 1, 0])], OWN
    )
    assert merged.material == "" and len(merged.mesh.faces) == 48
    colours = merged.attributes[TINT_ATTRIBUTE].reshape(4, 12, 3)
    for colour, expected in zip(colours, (RED, GREY, (0.5,) * 3, (0, 1, 0)), strict=True):
        np.testing.assert_allclose(colour, np.tile(expected, (12, 1)))
    rough = merged.attributes[ROUGHNESS_ATTRIBUTE].reshape(4, 12)
    np.testing.assert_allclose(rough[:, 0], [0.3, 0.6, 0.5, 0.4])
    metal = merged.attributes[METALLIC_ATTRIBUTE].reshape(4, 12)
    np.testing.assert_allclose(metal[:, 0], [0, 1, 0, 0])


def test_other_materials_stay_apart_and_keep_uvs():
    uvs = np.zeros((8, 2))
    mesh = Mesh(CUBE.vertices, CUBE.faces, uvs=uvs)
    result = merged_meshes(
        [part("road", mesh=mesh), part("red", mesh=mesh), part("road", mesh=mesh)], OWN
    )
    assert [merged.material for merged in result] == ["road", ""]
    assert result[0].mesh.uvs is not None and len(result[0].mesh.faces) == 24
    assert result[1].mesh.uvs is None
    assert result[0].attributes == {}


def test_flat_and_smooth_meshes_stay_apart():
    smooth = ball((0, 0, 0), 1, rows=4, columns=6)
    result = merged_meshes([part("red"), part("red", mesh=smooth)], OWN)
    assert [merged.mesh.normals is None for merged in result] == [True, False]


def test_parts_coloured_by_movers_stay_apart():
    result = merged_meshes(
        [part("tint"), part("tint", tint=RED), part("leaf")], OWN, own_tint=False
    )
    assert [merged.material for merged in result] == ["tint", "", "leaf"]
    grey = merged_meshes([part("tint"), part("tint", tint=RED)], OWN)
    assert [merged.material for merged in grey] == [""]
    np.testing.assert_allclose(grey[0].attributes[TINT_ATTRIBUTE][0], 0.5)


def test_empty_parts_vanish():
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert merged_meshes([Part(empty, "red")], OWN) == []


def test_no_face_is_lost():
    parts = [part(name) for name in OWN]
    assert sum(len(merged.mesh.faces) for merged in merged_meshes(parts, OWN)) == 12 * len(OWN)


def test_movers_colour_what_has_no_tint_or_a_role():
    parts = [part("tint"), part("tint", tint=RED), part("red"), part("leaf")]
    parts += [replace(parts[1], role=role) for role in ("own", "hair", "feet")]
    shades = Shades.of(parts, OWN)
    seen = shades.coloured((0.5, 0.25, 0.1), {"hair": (0.5, 1.0, 1.0)}).reshape(7, 12, 3)[:, 0]
    red = np.array(RED)
    own = np.array([0.5, 0.25, 0.1])
    expected = [own, red, red, own, red * own, red * [0.5, 1.0, 1.0], red]
    np.testing.assert_allclose(seen, expected)
    assert Shades.of([], OWN).coloured((1.0, 1.0, 1.0), {}).shape == (0, 3)


def test_tints_are_found_and_replaced():
    nested = {"type": "mask", "nested": {"type": "diffuse", "reflectance": TINT}}
    assert is_tinted(nested) and not is_tinted(OWN["red"])
    found = plugin(nested, tint={"type": "rgb", "value": 1})
    assert found["nested"]["reflectance"] == {"type": "rgb", "value": 1}
    assert nested["nested"]["reflectance"] == TINT


@pytest.mark.parametrize("name", MATERIALS)
def test_base_colours_conserve_energy(name):
    bsdf = MATERIALS[name].get("bsdf", MATERIALS[name])
    if "specular_reflectance" in bsdf:  # a perfect mirror: silver behind glass
        assert max(bsdf["specular_reflectance"]["value"]) <= 0.9
        return
    colour = bsdf.get("base_color", bsdf.get("reflectance"))
    # Rooms, cabins and lamps keep their own bounds: test_rooms.py and test_cabins.py.
    deep = ("tint", "rooms", "cabin", "lens")
    assert colour["type"] in deep or max(colour["value"]) <= 0.85
    assert bsdf.get("roughness", 1.0) >= 0.02
