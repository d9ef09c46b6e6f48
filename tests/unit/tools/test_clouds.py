from dataclasses import replace

import numpy as np
import pytest
import yaml
from bakers.skies.bake import CLOUD_LOSS, bake_clouds, cloud_recipe
from bakers.skies.build import make_clouds
from bakers.skies.recipe import CloudRecipe

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.exr import read_exr, write_exr
from sumo3dviz_pt.library.pictures import cloud_image, cloud_layer

pytestmark = pytest.mark.slow

SMALL = CloudRecipe(24, 3, (0.8, 0.9), 0.4, cirrus=0.4, steps=24, texels=32, span=8_000.0)


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
    empty = make_clouds(replace(SMALL, cover=0.0, cirrus=0.0))
    assert empty.cover.max() == 0.0


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
        "recipe": {"rows": 12, "seed": 1, "cover": 0.4, "steps": 8, "texels": 16, "span": 8e3},
    }
    (tmp_path / "asset.yaml").write_text(yaml.safe_dump(meta), encoding="utf-8")
    (written,) = bake_clouds(tmp_path, lossy=None)
    image, _ = read_exr(written)
    made = make_clouds(cloud_recipe(meta))
    assert np.array_equal(np.float16(cloud_image(made)), np.float16(image))
    stored = cloud_layer(image, lit_from=made.lit_from)
    assert np.abs(stored.cover - made.cover).max() < 0.01
    thick = made.cover > 0.1
    assert np.abs(stored.sunlit - made.sunlit)[thick].max() < 0.01
    assert np.abs(stored.skylit - made.skylit)[thick].max() < 0.01


def test_compression_loses_little(tmp_path, layer):
    image = cloud_image(layer)
    write_exr(tmp_path / "a.exr", {"radiance": image}, lossy=CLOUD_LOSS)
    write_exr(tmp_path / "b.exr", {"radiance": image}, lossy=CLOUD_LOSS)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    assert np.sqrt(np.mean((read_exr(tmp_path / "a.exr")[0] - image) ** 2)) < 0.02


@pytest.mark.parametrize(
    "kind", [{"cirrus": 0.7}, {"flakes": 0.8}, {"mackerel": 0.8}, {"stratus": True}]
)
def test_sheets_are_plausible_and_have_no_seam(kind):
    made = make_clouds(CloudRecipe(48, 5, (0.8, 0.7), **kind))
    for values in (made.cover, made.sunlit, made.skylit):
        assert np.isfinite(values).all() and values.min() >= 0 and values.max() < 2
    assert 0.01 < made.cover.mean() <= 1
    assert (made.cover * made.skylit).std() > 0.01
    step = np.abs(np.diff(made.cover * made.skylit, axis=1)).mean(axis=0)
    seam = np.abs((made.cover * made.skylit)[:, 0] - (made.cover * made.skylit)[:, -1]).mean()
    assert seam <= 1.5 * step.max() + 1e-6
    if "stratus" in kind:
        assert made.cover.min() == 1.0
        rising = made.skylit.mean(axis=1)
        assert rising[0] > 1.8 * rising[-1], "darker at the horizon, as the CIE's"


@pytest.mark.parametrize("kind", ["cirrus", "mackerel"])
def test_thin_cloud_shines_around_a_low_sun(kind):
    dull = CloudRecipe(48, 5, (np.pi, 0.12), fades=1.0, **{kind: 0.8})
    plain, shining = make_clouds(dull), make_clouds(replace(dull, backlit=1.0))
    assert np.array_equal(plain.cover, shining.cover)
    gain = shining.sunlit - plain.sunlit
    towards, opposite = gain[40:, 90:102].mean(), gain[40:, :12].mean()
    assert towards > 0.05 and towards > 10 * opposite >= 0


def test_clouds_reach_as_low_as_the_recipe_says():
    high = CloudRecipe(180, 5, (0.8, 0.7), cirrus=0.8)
    low = replace(high, fades=1.0)
    near = slice(-6, -2)  # one to three degrees
    assert make_clouds(low).cover[near].mean() > 1.5 * make_clouds(high).cover[near].mean()


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
