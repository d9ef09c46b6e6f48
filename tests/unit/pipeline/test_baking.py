"""The library as a table, and its files made again."""

import shutil

import pytest
from alike import assert_assets_alike, assert_files_alike

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.news import Doing, News, heard_by
from sumo3dviz_pt.pipeline import baking

SMALL = "vehicles/e_scooter"


def test_families():
    others = ["areas", "buildings", "materials", "palettes", "people", "plants", "road_styles"]
    assert list(baking.families()) == [*others, "skies", "surfaces", "vehicles"]


def test_table_lists_every_asset_once():
    head, *rows = baking.listing([])
    assert head.split()[:2] == ["family", "name"]
    named = [tuple(row.split()[:2]) for row in rows]
    assert named == [(f, name) for f in baking.families() for name in catalog.names(f)]
    assert all(row.endswith("BSD-3-Clause") for row in rows)
    # Columns stand under each other.
    at = head.index("licence")
    assert {row[at:] for row in rows} == {"BSD-3-Clause"}


def test_row_says_size_and_triangles():
    (row,) = (row for row in baking.listing(["vehicles"]) if row.split()[1] == "sedan")
    meta = catalog.find("vehicles", "sedan").meta
    near = sum(part["triangles"] for part in meta["parts"])
    far = sum(part["triangles"] for part in meta["far"])
    assert f"{near:,} / {far:,}" in row
    assert f"{meta['length']:.2f} x {meta['width']:.2f} x {meta['height']:.2f}" in row


def test_a_family_can_be_chosen():
    assert {row.split()[0] for row in baking.listing(["skies"])[1:]} == {"skies"}


@pytest.mark.parametrize("call", [baking.listing, baking.build])
def test_unknown_families_are_refused_with_a_suggestion(call):
    with pytest.raises(ConfigError, match="did you mean 'vehicles'"):
        call(["vehicle"])


def test_unknown_assets_are_refused():
    with pytest.raises(ConfigError, match="did you mean 'e_scooter'"):
        baking.build(["vehicles/e_scoter"])


def test_built_again_is_the_same(tmp_path):
    news = []
    with heard_by(news.append):
        baking.build([SMALL], into=tmp_path)
    assert news == [News(Doing.BAKE, 0, 1, SMALL)]
    assert_assets_alike(tmp_path / SMALL, catalog.find(*SMALL.split("/")).folder)


def test_what_others_vary_is_there_too(tmp_path, monkeypatch):
    """An asset with a base is built from both recipes, in a folder of copies too."""
    assets = tmp_path / "assets" / "vehicles"
    shutil.copytree(catalog.find("vehicles", "e_scooter").folder, assets / "plain")
    (assets / "dark").mkdir()
    (assets / "dark" / "asset.yaml").write_text("base: plain\nshare: 0.5\n", encoding="utf-8")
    monkeypatch.setattr(catalog, "_DATA_ROOTS", (tmp_path,))
    catalog.names.cache_clear()
    catalog.find.cache_clear()
    try:
        out = tmp_path / "out"
        baking.build(["vehicles/dark"], into=out)
        assert {path.name for path in (out / "vehicles" / "plain").iterdir()} == {"asset.yaml"}
        assert_files_alike(out / "vehicles" / "dark", assets / "plain")
    finally:
        catalog.names.cache_clear()
        catalog.find.cache_clear()


@pytest.mark.parametrize("chosen", [["surfaces"], []])
def test_in_place_is_the_default_and_all_that_can_be_made(chosen):
    folders = []
    baking.build(chosen, bakers={"surfaces": folders.append})
    assert [folder.name for folder in folders] == list(catalog.names("surfaces"))
    assert folders[0] == catalog.find("surfaces", folders[0].name).folder


@pytest.mark.parametrize("word", ["people", "skies/sky_veil", "surfaces"])
def test_what_the_command_does_not_make_is_refused(word):
    """People have no files: they are built when they are needed. Maps are made by a tool."""
    with pytest.raises(ConfigError, match="not made by this command, only vehicles"):
        baking.build([word])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["vehicles/container"])
def test_what_is_built_again_is_what_travels(name, tmp_path):
    baking.build([name], into=tmp_path)
    family, _, asset = name.partition("/")
    assert_assets_alike(tmp_path / family / asset, catalog.find(family, asset).folder)
