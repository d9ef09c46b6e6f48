"""Materials and meshes as other tools know them."""

from pathlib import Path

import numpy as np
import pytest
from builders import box, plane
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.exports.looks import picture_of, pieces_of
from sumo3dviz_pt.library.materials import MATERIALS, surface_material
from sumo3dviz_pt.model.geometry import PAINTS, Mesh
from sumo3dviz_pt.model.scene import Part

TINTED = {"type": "principled", "base_color": {"type": "tint"}, "roughness": 0.3}


@pytest.mark.parametrize("name", sorted(MATERIALS))
def test_every_material_of_the_catalogue_has_a_look(name):
    (piece,) = pieces_of(Part(box((0, 0, 0), (1, 1, 1)), name), MATERIALS[name])
    look = piece.look
    assert all(0.0 <= channel <= 1.0 for channel in look.colour)
    assert 0.0 <= look.roughness <= 1.0 and 0.0 <= look.metallic <= 1.0
    assert 0.0 <= look.specular <= 1.0


@given(st.integers(0, 2**32 - 1))
def test_corners_keep_their_places_and_faces_their_colours(seed):
    rng = np.random.default_rng(seed)
    mesh = box((0, 0, 0), (1, 2, 3))
    tints = rng.choice(rng.random((3, 3)), len(mesh.faces))
    (piece,) = pieces_of(Part(mesh, "", tints), TINTED)
    made = piece.geometry
    assert np.allclose(made.points[made.faces], mesh.vertices[mesh.faces])
    assert np.abs(made.colours[made.faces] - tints[:, None]).max() <= 0.5 / 1024 + 1e-9


def test_painted_faces_of_a_road_have_no_picture_and_the_paints_colour():
    ground = plane(4.0)
    wear = np.tile([0.9, 0.0, 0.0], (4, 1)), np.tile([1.0, 1.0, 0.0], (4, 1))
    bsdf = surface_material("asphalt", textured=True)
    mean = bsdf["base_color"]["mean"]
    uvs = ground.vertices[:, :2]
    for own, expected in zip(wear, (0.9 * np.array(mean), PAINTS[0]), strict=True):
        (piece,) = pieces_of(Part(Mesh(ground.vertices, ground.faces, None, uvs, own), ""), bsdf)
        shown = piece.geometry.colours[0] * piece.look.colour
        if piece.look.picture is not None:
            shown = shown * np.array(mean) / picture_of(piece.look.picture).white
        assert np.allclose(shown, expected, atol=2e-3)


def test_a_picture_is_as_bright_as_its_reflectances():
    path = Path(surface_material("paving", textured=True)["base_color"]["filename"])
    made = picture_of(path)
    codes = made.pixels / 255.0
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    mean = surface_material("paving", textured=True)["base_color"]["mean"]
    assert np.allclose(made.white * linear.mean(axis=(0, 1)), mean, rtol=0.05)
