from dataclasses import replace

import numpy as np
import pytest
import yaml

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.exr import read_exr, write_exr
from sumo3dviz_pt.shapes.cloud_bake import bake_clouds, cloud_image, cloud_recipe
from sumo3dviz_pt.shapes.clouds import CloudRecipe, make_clouds

SMALL = CloudRecipe(24, 3, (0.8, 0.9), 0.4, cirrus=0.4, steps=24, texels=32)


@pytest.fixture(scope="module")
def layer():
    return make_clouds(SMALL)


def test_maps_are_plausible(layer):
    assert layer.cover.shape == layer.sunlit.shape == layer.skylit.shape == (24, 96)
    for values in (layer.cover, layer.sunlit, layer.skylit):
        assert values.dtype == np.float32 and np.isfinite(values).all() and values.min() >= 0
    assert 0.05 < layer.cover.mean() < 0.9 and layer.cover.max() <= 1
    thick = layer.cover > 0.8
    assert 0.1 < np.median(layer.sunlit[thick]) < 1.2
    assert 0.3 < np.median(layer.skylit[thick]) < 1.2


def test_same_recipe_same_clouds(layer):
    again = make_clouds(SMALL)
    assert np.array_equal(layer.cover, again.cover)
    assert not np.array_equal(layer.cover, make_clouds(replace(SMALL, seed=4)).cover)


def test_cover_rises_with_the_recipe(layer):
    more = make_clouds(replace(SMALL, cover=0.9))
    assert more.cover.mean() > layer.cover.mean() + 0.1


def test_no_clouds_at_all():
    empty = make_clouds(replace(SMALL, cover=0.0, depth=1.0, cirrus=0.0))
    assert empty.cover.max() < 0.2


def test_thin_edges_towards_the_sun_are_brightest():
    bare = replace(SMALL, cirrus=0.0, cover=0.5, at_sun=0.8)
    made = make_clouds(bare)
    row = int((1 - bare.sun[1] / (np.pi / 2)) * 24)
    column = int(bare.sun[0] / (2 * np.pi) * 96)
    near = np.roll(made.sunlit * (made.cover > 0.3), 48 - column, axis=1)[
        max(row - 5, 0) : row + 6, 40:57
    ]
    assert near.max() > np.median(made.sunlit[made.cover > 0.3])


def test_baking_stores_what_was_made(tmp_path):
    meta = {
        "map": "clouds.exr",
        "sun": {"azimuth": 45, "elevation": 50},
        "recipe": {"rows": 12, "seed": 1, "cover": 0.4, "steps": 8, "texels": 16},
    }
    (tmp_path / "asset.yaml").write_text(yaml.safe_dump(meta), encoding="utf-8")
    image, _ = read_exr(bake_clouds(tmp_path, encode=write_exr))
    made = make_clouds(cloud_recipe(meta))
    assert np.abs(image[..., 0] - made.cover).max() < 0.003
    shown = made.cover > 0.01
    assert np.abs(image[..., 1] - made.sunlit)[shown].max() < 0.02
    assert np.array_equal(np.float16(cloud_image(made)), np.float16(image))


@pytest.mark.parametrize("name", catalog.names("skies"))
def test_sky_assets_are_complete(name):
    entry = catalog.find("skies", name)
    assert entry.meta["kind"] == "sky" and entry.meta["licence"] == "BSD-3-Clause"
    assert (entry.folder / entry.meta["map"]).stat().st_size < 3_000_000
    assert cloud_recipe(entry.meta).rows >= 512


def test_wrong_recipes_are_named():
    with pytest.raises(ConfigError, match="sun"):
        cloud_recipe({})
    with pytest.raises(ConfigError, match="colour"):
        cloud_recipe({"sun": {"azimuth": 1, "elevation": 2}, "recipe": {"colour": 1}})
