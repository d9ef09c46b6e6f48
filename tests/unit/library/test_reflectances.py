"""Nothing reflects more than 0.85: what we ship, and what users bring."""

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.colours import CLOTHES, SUMO_YELLOW, paint_of
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.library.buildings.palettes import palette
from sumo3dviz_pt.library.buildings.styles import BLOCKS, HOMES, SHOPS
from sumo3dviz_pt.library.materials import MATERIALS, colour_of, surface_bsdf, surface_material
from sumo3dviz_pt.library.paints import EUROPEAN, SOBER
from sumo3dviz_pt.library.vehicles.user_mesh import read_user_vehicle
from sumo3dviz_pt.model.traffic import VehicleType

BRIGHTEST = 0.85
"""Where Mitsuba's `principled` still conserves energy."""

ROUGHEST, SMOOTHEST = 1.0, 0.02
TEXTURES = ("rgb", "bitmap", "untiled")
SURFACES = catalog.names("surfaces")


def linear(codes):
    """Linear reflectance of 8-bit sRGB codes (IEC 61966-2-1)."""
    encoded = np.asarray(codes, dtype=np.float64) / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def textures_in(bsdf):
    """All textures and colours of a material with the setting they stand for."""
    for key, value in bsdf.items():
        if isinstance(value, dict):
            yield from [(key, value)] if value["type"] in TEXTURES else textures_in(value)


def values_of(texture):
    """What a texture says, as the renderer takes it."""
    if texture["type"] == "rgb":
        return np.array(texture["value"])
    if "roughness" in texture:
        return np.array([texture["roughness"]])
    mi = package("mitsuba")
    mi.set_variant("scalar_rgb")
    codes = np.array(mi.Bitmap(texture["filename"]))
    assert codes.dtype == np.uint8
    return codes / 255.0 if texture.get("raw") else linear(codes)


def numbers_of(bsdf, key):
    """A number that a material gives, also inside a two-sided one."""
    inner = bsdf.get("bsdf", bsdf)
    return inner.get(key)


@pytest.mark.parametrize("name", sorted(MATERIALS))
def test_materials_keep_to_the_limits(name):
    bsdf = MATERIALS[name]
    for key, texture in textures_in(bsdf):
        assert values_of(texture).max() <= BRIGHTEST, key
    roughness = numbers_of(bsdf, "roughness")
    assert roughness is None or SMOOTHEST <= roughness <= ROUGHEST


@pytest.mark.parametrize("name", SURFACES)
def test_surfaces_keep_to_the_limits(name):
    """Every texel, as bright as the renderer sees it."""
    bsdf = surface_bsdf(catalog.find("surfaces", name))
    found = dict(textures_in(bsdf))
    assert "base_color" in found
    texels = values_of(found["base_color"])
    assert texels.max() <= BRIGHTEST
    # What textures without tiles are made around, and what stands for them in the distance.
    albedo = catalog.find("surfaces", name).meta["albedo"]
    np.testing.assert_allclose(texels.mean(axis=(0, 1))[:3], albedo, atol=0.02)
    if "roughness" in found:
        assert values_of(found["roughness"]).min() >= SMOOTHEST
    else:
        assert SMOOTHEST <= bsdf["roughness"] <= ROUGHEST
    plain = surface_material(name, textured=False)
    assert max(plain["reflectance"]["value"]) <= BRIGHTEST


@pytest.mark.parametrize("fleet", [EUROPEAN, SOBER, CLOTHES])
def test_palettes_keep_to_the_limits(fleet):
    assert np.min(fleet.colours) > 0 and np.max(fleet.colours) <= BRIGHTEST
    assert max(SUMO_YELLOW) <= BRIGHTEST


@pytest.mark.parametrize("styles", [HOMES, SHOPS, BLOCKS])
def test_building_colours_keep_to_the_limits(styles):
    for style in styles.values():
        for seed in range(20):
            colours = palette(style.colours, np.random.default_rng(seed), colour_of("#ffffff"))
            assert max(max(colour) for _, colour in colours.values() if colour) <= BRIGHTEST
            assert {material for material, _ in colours.values()} <= set(MATERIALS)


@pytest.mark.parametrize("text", ["#ffffff", "#fefefe", "#00ff00", "#f0f0f0"])
def test_colours_of_scene_files_are_clamped(text):
    """Roads, objects and vehicles all read their colours with `colour_of`."""
    assert max(colour_of(text)) <= BRIGHTEST
    assert max(surface_material(text, textured=True)["reflectance"]["value"]) <= BRIGHTEST


@pytest.mark.parametrize("vclass", ["passenger", "bus", "pedestrian"])
@pytest.mark.parametrize("colours", ["sumo", ("#ffffff",), "european"])
def test_vehicle_colours_are_clamped(vclass, colours):
    kind = VehicleType("v", vclass, 5.0, 1.8, 1.5, colour=(1.0, 1.0, 1.0))
    for key in ("a", "b", "c"):
        assert max(paint_of(vclass, kind, key=key, colours=colours, seed=3)) <= BRIGHTEST


@pytest.mark.parametrize(("brightest", "fine"), [(0.9, True), (1.0, True), (1.5, False)])
def test_images_that_would_make_light_are_refused(tmp_path, brightest, fine):
    values = np.full((4, 8, 3), 0.3, dtype=np.float32)
    values[1, 2, 0] = brightest
    path = tmp_path / "ground.exr"
    write_exr(path, {"radiance": values}, half=False)
    if fine:
        assert surface_material(str(path), textured=True)["type"] == "diffuse"
    else:
        with pytest.raises(ConfigError, match=r"reflectances up to 1\.5"):
            surface_material(str(path), textured=True)


def test_colours_of_users_meshes_are_clamped(tmp_path):
    import trimesh

    box = trimesh.creation.box((2, 1, 4))
    box.visual.face_colors = [255, 255, 255, 255]
    path = tmp_path / "white.ply"
    box.export(path)
    ((_, finish),) = read_user_vehicle(path, materials=MATERIALS).pieces
    assert max(finish.colour) <= BRIGHTEST


def test_colours_of_users_yaml_are_clamped(tmp_path):
    (tmp_path / "a.obj").write_text("v 5 1 1\nv 3 2 1\nv 3 0 4\nf 1 2 3\n", encoding="utf-8")
    about = tmp_path / "a.yaml"
    text = "{mesh: a.obj, materials: {'*': {colour: '#ffffff', roughness: 0.0}}}"
    about.write_text(text, encoding="utf-8")
    ((_, finish),) = read_user_vehicle(about, materials=MATERIALS).pieces
    assert max(finish.colour) <= BRIGHTEST
