"""The library as a table."""

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.inspection import catalogue


def test_families():
    others = ["areas", "buildings", "materials", "palettes", "people", "plants", "road_styles"]
    assert list(catalogue.families()) == [*others, "shop_words", "skies", "surfaces", "vehicles"]


def test_table_lists_every_asset_once():
    head, *rows = catalogue.listing([])
    assert head.split()[:2] == ["family", "name"]
    named = [tuple(row.split()[:2]) for row in rows]
    assert named == [(f, name) for f in catalogue.families() for name in catalog.names(f)]
    assert all(row.endswith("BSD-3-Clause") for row in rows)
    # Columns stand under each other.
    at = head.index("licence")
    assert {row[at:] for row in rows} == {"BSD-3-Clause"}


def test_row_says_size_and_triangles():
    (row,) = (row for row in catalogue.listing(["vehicles"]) if row.split()[1] == "sedan")
    meta = catalog.find("vehicles", "sedan").meta
    near = sum(meta["parts"].values())
    far = sum(meta["far"].values())
    full = sum(meta["full"].values())
    assert f"{full:,} / {near:,} / {far:,}" in row
    assert f"{meta['length']:.2f} x {meta['width']:.2f} x {meta['height']:.2f}" in row


def test_a_family_can_be_chosen():
    assert {row.split()[0] for row in catalogue.listing(["skies"])[1:]} == {"skies"}


def test_unknown_families_are_refused_with_a_suggestion():
    with pytest.raises(ConfigError, match="did you mean 'vehicles'"):
        catalogue.listing(["vehicle"])
