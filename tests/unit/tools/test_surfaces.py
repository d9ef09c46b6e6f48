import numpy as np
import pytest
import yaml
from bakers.surfaces.bake import bake_surface, srgb_bytes, surface_recipe
from bakers.surfaces.build import MAKERS, make_surface
from bakers.surfaces.maps import BRIGHTEST, Recipe
from PIL import Image as Pillow

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError

NAMES = catalog.names("surfaces")
GROUNDS = (
    *("grass", "dry_grass", "forest", "gravel", "halloween"),
    *("stone", "sand", "chess", "chesslarge"),
)
FAMILY_LIMIT, FILE_LIMIT = 25_000_000, 6_000_000


def linear(path):
    with Pillow.open(path) as picture:
        codes = np.asarray(picture.convert("RGB")) / 255
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def small(name, pixels=128):
    """An asset's recipe at fewer pixels."""
    maker, recipe = surface_recipe(catalog.find("surfaces", name).meta)
    tile = recipe.tile * pixels / recipe.pixels if maker != "chess" else recipe.tile
    if maker in ("brick", "paving", "roof_tiles"):
        tile = recipe.tile
    return maker, Recipe(pixels, tile, recipe.albedo, recipe.seed, recipe.params)


def test_all_promised_surfaces_exist():
    roads = ["asphalt", "asphalt_old", "concrete", "paving", "bicycle"]
    walls = ["plaster", "brick", "roof_tiles"]
    grounds = [f"ground_{kind}" for kind in GROUNDS]
    assert set(roads + walls + grounds) <= set(NAMES)


def test_files_are_small():
    files = [f for name in NAMES for f in catalog.find("surfaces", name).folder.glob("*.png")]
    assert max(file.stat().st_size for file in files) <= FILE_LIMIT
    assert sum(file.stat().st_size for file in files) <= FAMILY_LIMIT


@pytest.mark.parametrize("name", NAMES)
def test_baked_map_is_what_its_asset_says(name):
    entry = catalog.find("surfaces", name)
    assert entry.meta["kind"] == "surface" and entry.meta["licence"] == "BSD-3-Clause"
    albedo = linear(entry.folder / "albedo.png")
    assert albedo.mean(axis=(0, 1)) == pytest.approx(entry.meta["albedo"], rel=0.02)
    assert albedo.max() <= BRIGHTEST + 0.01


@pytest.mark.parametrize("name", NAMES)
def test_baked_map_tiles(name):
    albedo = linear(catalog.find("surfaces", name).folder / "albedo.png").mean(axis=2)
    for axis in (0, 1):
        inside = np.abs(np.diff(albedo, axis=axis)).mean(axis=1 - axis)
        seam = np.abs(albedo.take(0, axis) - albedo.take(-1, axis)).mean()
        assert seam <= 1.1 * inside.max() + 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_makers_are_deterministic_and_keep_the_mean(name):
    maker, recipe = small(name)
    first, second = make_surface(maker, recipe), make_surface(maker, recipe)
    assert np.array_equal(first.albedo, second.albedo)
    assert first.albedo.mean(axis=(0, 1)) == pytest.approx(recipe.albedo, rel=0.01)
    assert first.albedo.min() > 0 and first.albedo.max() <= BRIGHTEST
    if first.roughness is not None:
        assert first.roughness.min() > 0.2 and first.roughness.max() <= 1


def test_every_maker_is_used():
    assert {surface_recipe(catalog.find("surfaces", name).meta)[0] for name in NAMES} == set(MAKERS)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ground_chess", "plaster"])
def test_rebuilding_gives_the_baked_map(tmp_path, name):
    source = catalog.find("surfaces", name).folder
    folder = tmp_path / name
    folder.mkdir()
    text = (source / "asset.yaml").read_text(encoding="utf-8")
    (folder / "asset.yaml").write_text(text, encoding="utf-8")
    (written,) = bake_surface(folder)
    with Pillow.open(written) as new, Pillow.open(source / "albedo.png") as old:
        difference = np.asarray(new).astype(int) - np.asarray(old)
    # Another machine's FFT may round a few texels differently.
    assert np.abs(difference).max() <= 1 and (difference != 0).mean() < 1e-3


def test_roughness_is_baked_where_the_bsdf_asks(tmp_path):
    maker, recipe = small("asphalt")
    meta = {
        "scale": recipe.tile,
        "albedo": list(recipe.albedo),
        "bsdf": {
            "base_color": {"filename": "albedo.png"},
            "roughness": {"filename": "roughness.png"},
        },
        "recipe": {"maker": maker, "pixels": 64, "seed": 1},
    }
    (tmp_path / "asset.yaml").write_text(yaml.safe_dump(meta), encoding="utf-8")
    assert {file.name for file in bake_surface(tmp_path)} == {
        "albedo.png",
        "roughness.png",
    }


def test_bad_recipes_are_named():
    with pytest.raises(ConfigError, match="lacks 'recipe'"):
        surface_recipe({})
    with pytest.raises(ConfigError, match="no surface maker is called 'moss'"):
        make_surface("moss", Recipe(8, 1.0, (0.1, 0.1, 0.1)))


def test_srgb_bytes_are_the_standards():
    assert srgb_bytes(np.array([-1, 0, 0.18, 1, 2])).tolist() == [0, 0, 118, 255, 255]


@pytest.mark.parametrize("kind", ["grass", "dry_grass", "forest", "gravel", "halloween"])
def test_natural_grounds_have_detail_but_no_single_eyecatcher(kind):
    """Mean over 32 x 32 texels varies little against the whole, and grain is there."""
    path = catalog.find("surfaces", f"ground_{kind}").folder / "albedo.png"
    grey = linear(path).mean(axis=2)
    side = len(grey) // 32
    blocks = grey.reshape(32, side, 32, side).mean(axis=(1, 3))
    assert grey.std() / grey.mean() > 0.15
    assert np.abs(blocks / grey.mean() - 1).max() < 1.1
    assert path.stat().st_size < 1_500_000
