"""What the comparison with Cycles exports, and how it reads costs off curves."""

from dataclasses import asdict

import numpy as np
import pytest
from bench.blender.equal_error import CYCLES, Row, at_equal_error, cost_at, row_of
from bench.blender.export import (
    blender_camera,
    blender_panorama,
    face_colours,
    material_of,
    plain_material,
    rounded,
    solid,
    without_textures,
)
from bench.cycles import KERNEL, page
from builders import diffuse, plane, scene_of, static, view_at

from sumo3dviz_pt.library.materials import coated
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.render.kernel.rows import RowMaker

ASPHALT = {
    "type": "principled",
    "base_color": {
        "type": "untiled",
        "filename": "none.png",
        "wear": True,
        "mean": (0.1, 0.2, 0.3),
    },
    "roughness": {"type": "untiled", "filename": "none.png", "roughness": 0.64, "mean": (1, 1, 1)},
}
TRIANGLE = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])


def test_textures_become_their_means() -> None:
    grass = {"type": "untiled", "filename": "none.png", "mean": (0.1, 0.2, 0.3), "gain": (2, 1, 1)}
    assert plain_material({"type": "diffuse", "reflectance": grass}) == {
        "type": "diffuse",
        "reflectance": {"type": "rgb", "value": [0.2, 0.2, 0.3]},
    }
    stained = {"type": "stained", "texture": grass, "tint": {"type": "tint"}, "mean": [1, 1, 1]}
    assert plain_material({"base_color": stained}) == {"base_color": {"type": "tint"}}
    assert plain_material(ASPHALT)["roughness"] == 0.64


def test_a_worn_road_keeps_its_paint() -> None:
    wear = np.array([(0.5, 0.0, 0.0)] * 3 + [(1.0, 1.0, 0.0)] * 3)
    mesh = Mesh(np.concatenate([TRIANGLE, TRIANGLE + 1.0]), [(0, 1, 2), (3, 4, 5)], wear=wear)
    road, painted = face_colours(mesh, np.array([0.1, 0.2, 0.3]))
    assert road == pytest.approx([0.05, 0.1, 0.15])
    assert painted.min() > 0.4
    scene = scene_of([static("road", mesh, "asphalt")], {"asphalt": ASPHALT})
    (part,) = without_textures(scene).static
    assert part.part.tint == pytest.approx(np.array([road, painted]))


def test_what_has_no_texture_stays_as_it_is() -> None:
    scene = scene_of([static("ground", plane(10.0), "grey")], {"grey": diffuse(0.3)})
    plain = without_textures(scene)
    assert plain.materials == scene.materials
    assert plain.static == scene.static


def test_leaves_are_flat() -> None:
    crown = Mesh(TRIANGLE, [(0, 1, 2)], normals=np.tile([0.0, 0.0, 1.0], (3, 1)))
    leaf = {"type": "principledthin", "base_color": {"type": "tint"}, "diff_trans": 1.0}
    scene = scene_of([static("tree", crown, "leaf"), static("wall", crown, "grey")],
                     {"leaf": leaf, "grey": diffuse(0.3)})  # fmt: skip
    tree, wall = without_textures(scene).static
    assert tree.part.mesh.normals is None
    assert wall.part.mesh.normals is not None


def test_a_sky_begins_in_the_west_from_below() -> None:
    sky = np.zeros((4, 8, 3), np.float32)
    sky[0, 2] = 1.0  # high in the east
    turned = blender_panorama(sky)
    assert np.argwhere(turned[..., 0] == 1.0).tolist() == [[3, 4]]


def test_the_camera_looks_along_its_own_minus_z() -> None:
    view = view_at((10.0, 20.0, 30.0), heading=90.0, pitch=0.0)
    matrix = blender_camera(view, np.array([10.0, 20.0, 0.0]))
    assert matrix[:3, 3] == pytest.approx([0.0, 0.0, 30.0])
    assert -matrix[:3, 2] == pytest.approx(view.forward)
    assert matrix[:3, 1] == pytest.approx([0.0, 0.0, 1.0])
    assert np.linalg.det(matrix) == pytest.approx(1.0)


def test_a_coat_reflects_instead_of_what_lies_under_it() -> None:
    paint = coated({"type": "tint"}, roughness=0.1, under=0.4)
    said = material_of(RowMaker().row(paint, painted=True))
    assert (said["kind"], said["coat"], said["painted"]) == ("principled", 1.0, True)
    assert (said["coat_roughness"], said["ior"]) == (0.1, 1.0)


def test_a_leaf_lets_half_of_its_light_through() -> None:
    leaf = {"type": "principledthin", "base_color": {"type": "tint"}, "diff_trans": 1.0}
    said = material_of(RowMaker().row(leaf))
    assert (said["kind"], said["through"], said["painted"]) == ("leaf", 0.5, False)


def test_faces_without_area_are_found() -> None:
    faces = np.array([(0, 1, 2), (0, 2, 1), (0, 1, 1)])
    assert solid(TRIANGLE, faces).tolist() == [True, True, False]


def test_numbers_keep_the_digits_that_count() -> None:
    assert rounded(np.array([0.0, 1234.0, -0.012345])).tolist() == [0.0, 1230.0, -0.0123]


def test_costs_lie_on_a_straight_line_between_logarithms() -> None:
    errors, costs = np.array([0.4, 0.2, 0.1]), np.array([1.0, 4.0, 16.0])
    assert cost_at(errors, costs, np.sqrt(0.2 * 0.1)) == pytest.approx(8.0)
    assert np.isnan(cost_at(errors, costs, 0.05))
    assert np.isnan(cost_at(errors, costs, 0.5))


def test_the_table_says_what_equal_error_costs() -> None:
    rows = [
        row_of((CYCLES, 4), [(4.0, 0.2, 0.02), (2.0, 0.2, 0.02), (3.0, 0.2, 0.02)]),
        Row(CYCLES, 8, False, 1, 5.0, 0.1, 0.001),
        Row("ours", 4, False, 1, 1.0, 0.4, 0.04),
        Row("ours", 16, False, 1, 4.0, 0.2, 0.01),
        Row("ours", 16, True, 1, 9.0, 0.2, 0.02),
    ]
    lines = at_equal_error(rows)
    # A further sample costs 0.25 here and 0.5 there: 16 of ours cost twice as much as 4.
    assert lines[2] == "| 4 samples: FLIP 0.2000 | 3.00 | 4.00 | 1.33 | 2.00 |"
    assert lines[3] == "| 4 samples: relative MSE 0.0200 | 3.00 | 2.00 | 0.67 | 1.00 |"
    assert lines[4] == "| 8 samples: FLIP 0.1000 | 5.00 | - | - | - |"
    assert lines[-1] == "A further sample of all pixels [CPU-s]: Cycles 0.500, ours 0.250."


def test_the_page_says_how_and_with_what_it_was_measured() -> None:
    known = {"cpu": "a processor", "threads": 2, "mitsuba": "3", "drjit": "1", "git": "abc"}
    rows = [
        Row(CYCLES, 4, False, 3, 2.0, 0.2, 0.02),
        Row(KERNEL, 1, False, 3, 1.0, 0.4, 0.04),
        Row(KERNEL, 4, False, 3, 3.0, 0.1, 0.01),
    ]
    both = {KERNEL: 1.05, CYCLES: 1.0}
    about = {
        "machine": known, "blender": "4.5", "size": [640, 360], "reference": 512,
        "first": both, "means": both, "references_flip": 0.05, "moving": both,
        "rows": [asdict(row) for row in rows],
    }  # fmt: skip
    said = page({"night": about})
    assert "camera `corner`, 458 s, 640x360. a processor, 2 threads" in said
    assert "(+5.0%), FLIP between them 0.050" in said
    assert "| our kernel | 4 | 3 | 3.00 | 0.1000 | 0.0100 |" in said
    assert "Cycles +1.00 (not in them)" in said
