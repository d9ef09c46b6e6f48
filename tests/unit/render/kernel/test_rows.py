"""Materials as rows of numbers: what is understood, and what is left to Mitsuba."""

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.materials import (
    MATERIALS,
    TINT,
    matt,
    principled,
    surface_bsdf,
    two_sided,
)
from sumo3dviz_pt.render.compound import COMPOUND
from sumo3dviz_pt.render.kernel.rows import PLAIN, MaterialKind, Row, RowMaker, kinds_of, lobes_of

COLOUR = (0.5, 0.25, 0.125)


def row_of(bsdf, **how):
    return RowMaker().row(bsdf, **how)


@pytest.mark.parametrize("name", MATERIALS)
def test_every_named_material_is_understood(name):
    assert MaterialKind.FOREIGN not in row_of(MATERIALS[name]).kind


@pytest.mark.parametrize("name", catalog.names("surfaces"))
def test_every_surface_is_understood(name):
    bsdf = surface_bsdf(catalog.find("surfaces", name))
    stained = {"type": "stained", "texture": bsdf["base_color"], "tint": TINT, "mean": [0.5] * 3}
    for each in (bsdf, {**bsdf, "base_color": stained}):
        assert MaterialKind.FOREIGN not in row_of(each).kind


def test_numbers_of_a_plain_material_are_kept():
    row = row_of(principled(COLOUR, roughness=0.3, metallic=0.25))
    assert (row.kind, row.colour, row.roughness, row.metallic) == (PLAIN, COLOUR, 0.3, 0.25)
    assert row.eta == pytest.approx(1.5)  # a specular of 0.5 reflects 4 %


def test_kinds_of_materials():
    assert row_of(matt(COLOUR)).kind == MaterialKind.MATT
    assert row_of(two_sided(matt(COLOUR))).kind == MaterialKind.MATT | MaterialKind.OPEN
    assert (
        row_of(MATERIALS["leaf"]).kind
        == MaterialKind.LEAF | MaterialKind.OPEN | MaterialKind.TINTED
    )
    assert row_of(MATERIALS["leaf"]).through == 0.4
    assert row_of(COMPOUND).kind == MaterialKind.TINTED


def test_only_instances_are_painted():
    assert row_of(MATERIALS["paint"]).kind == MaterialKind.TINTED
    assert row_of(MATERIALS["paint"], painted=True).kind == MaterialKind.PAINTED
    assert row_of(COMPOUND, painted=True).kind == MaterialKind.TINTED


@pytest.mark.parametrize(
    "bsdf",
    [
        {"type": "dielectric"},
        {**principled(COLOUR, roughness=0.3), "spec_trans": 0.5},
        {**principled(COLOUR, roughness=0.3), "spec_tint": 0.5},
        {**principled(COLOUR, roughness=0.3), "roughness": {"type": "checkerboard"}},
        {**principled(COLOUR, roughness=0.3), "base_color": {"type": "checkerboard"}},
        {"type": "normalmap", "bsdf": principled(COLOUR, roughness=0.3)},
        two_sided({"type": "conductor"}),
    ],
)
def test_what_is_not_understood_is_foreign(bsdf):
    assert row_of(bsdf) == Row(MaterialKind.FOREIGN)


def test_equal_textures_have_one_number():
    maker = RowMaker()
    texture = {"type": "untiled", "filename": "a.png"}
    first, second = (maker.row(principled(texture, roughness=r)) for r in (0.2, 0.4))
    other = maker.row(principled({**texture, "uneven": 0.1}, roughness=0.2))
    assert (first.texture, second.texture, other.texture) == (0, 0, 1)
    assert len(maker.untiled) == 2


def test_what_no_material_has_is_left_out():
    rows = [row_of(principled(COLOUR, roughness=0.3))]
    assert kinds_of(rows) == PLAIN
    lobes = lobes_of(rows, metals=False)
    assert not any((lobes.coats, lobes.leaves, lobes.matts, lobes.two_sided, lobes.metals))
    assert lobes_of([row_of(MATERIALS["paint"])], metals=False).coats
