"""Assets that are numbers alone: new folders are found, mistakes are named, order is told."""

import shutil
from dataclasses import dataclass, is_dataclass
from typing import Literal, get_args, get_type_hints

import numpy as np
import pytest
import yaml

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library import materials
from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_asset, read_family
from sumo3dviz_pt.library.buildings import palettes, styles
from sumo3dviz_pt.library.plants import species

KINDS = {
    "plants": species._PlantFile,
    "buildings": styles._BuildingFile,
    "palettes": palettes._PalettesFile,
    "materials": materials._MaterialsFile,
}
SHIPPED = catalog.data_root("assets")
HEAD = {"kind": "lamp", "order": 1, "about": "a lamp", "licence": "BSD-3-Clause"}


@dataclass(frozen=True, slots=True)
class Lamp(RecipeValue):
    height: float
    arms: int = 1
    colour: tuple[float, float, float] = (0.1, 0.1, 0.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class LampFile(AssetFile):
    kind: Literal["lamp"]
    recipe: Lamp


@pytest.fixture
def assets(tmp_path, monkeypatch):
    """An empty folder of assets in the place of ours."""
    monkeypatch.setattr(catalog, "_DATA_ROOTS", (tmp_path,))
    cached = (catalog.names, catalog.find)
    for each in cached:
        each.cache_clear()
    yield tmp_path / "assets"
    for each in cached:
        each.cache_clear()


def write(folder, name, content):
    (folder / name).mkdir(parents=True)
    (folder / name / "asset.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")


def test_assets_come_in_their_order_then_by_name(assets):
    for name, order in (("alpha", 30), ("beta", 10), ("gamma", 20), ("delta", 10)):
        write(assets / "lamps", name, {**HEAD, "order": order, "recipe": {"height": 4}})
    found = read_family("lamps", LampFile)
    assert list(found) == ["beta", "delta", "gamma", "alpha"]
    assert found["beta"].recipe == Lamp(4.0)
    assert isinstance(found["beta"].recipe.height, float)
    assert read_asset("lamps", "alpha", LampFile) == found["alpha"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"colour": "red"}, "asset.yaml: colour: this key is unknown"),
        ({"recipe": {"heigth": 4}}, "recipe.heigth: this key is unknown"),
        ({"recipe": {}}, "recipe.height: this key is missing"),
        ({"recipe": {"height": "tall"}}, "recipe.height: this should be a valid number"),
        ({"recipe": {"height": 4, "arms": 1.5}}, "recipe.arms: this should be a valid integer"),
        ({"recipe": {"height": 4, "colour": [1, 1]}}, "recipe.colour.2: this key is missing"),
        ({"kind": "tree"}, "kind: this should be 'lamp'"),
    ],
)
def test_mistakes_are_named_with_their_file(assets, change, message):
    write(assets / "lamps", "wrong", {**HEAD, "recipe": {"height": 4}, **change})
    with pytest.raises(ConfigError) as caught:
        read_family("lamps", LampFile)
    assert message in str(caught.value)
    assert caught.value.file == assets / "lamps" / "wrong" / "asset.yaml"


def dataclasses_in(hint):
    """A dataclass and all that its fields lead to."""
    if is_dataclass(hint):
        yield hint
        for inner in get_type_hints(hint).values():
            yield from dataclasses_in(inner)
    for inner in get_args(hint):
        yield from dataclasses_in(inner)


@pytest.mark.parametrize(("family", "count"), [*zip(KINDS, (2, 6, 4, 2), strict=True)])
def test_every_level_of_every_family_refuses_unknown_keys(family, count):
    found = set(dataclasses_in(KINDS[family]))
    assert len(found) == count
    assert all(kind.__pydantic_config__["extra"] == "forbid" for kind in found)


def test_a_new_folder_is_a_new_species(assets):
    own = species._FILES["lime"]
    assert own.kind == "tree"
    shutil.copytree(SHIPPED / "plants", assets / "plants")
    content = yaml.safe_load((assets / "plants" / "lime" / "asset.yaml").read_text("utf-8"))
    write(assets / "plants", "ash", {**content, "order": 85})
    found = read_family("plants", species._PlantFile)
    trees = [name for name, file in found.items() if file.kind == "tree"]
    assert trees == [*species.SPECIES, "ash"]
    assert found["ash"].recipe == own.recipe


@pytest.mark.parametrize("family", KINDS)
def test_no_two_assets_have_the_same_place(family):
    found = read_family(family, KINDS[family])
    assert len({file.order for file in found.values()}) == len(found)


def test_no_two_buildings_of_a_kind_have_the_same_name():
    named_ones = [f for f in styles._FILES.values() if f.kind in ("home", "shop", "block")]
    assert len(named_ones) == len(styles.HOMES) + len(styles.SHOPS) + len(styles.BLOCKS)


def test_no_material_stands_in_two_files(monkeypatch):
    found = read_family("materials", materials._MaterialsFile)
    assert sum(len(file.recipe) for file in found.values()) == len(materials.MATERIALS)
    one = next(iter(found.values()))
    monkeypatch.setattr(materials, "read_family", lambda *_: {"one": one, "other": one})
    with pytest.raises(ConfigError, match=r"materials/other: .* is in another file, too"):
        materials._read_materials()


def test_colours_are_looked_up_in_palettes():
    (cream,) = palettes.coats(["facades.cream"])
    everything = palettes.coats(["facades", cream])
    assert everything[0] == everything[-1] == cream
    assert len(everything) > 5
    with pytest.raises(ConfigError, match=r"did you mean 'facades'"):
        palettes.coats(["facade"])
    with pytest.raises(ValueError, match="did you mean 'plaster'"):
        palettes.Coat("plastr", (0.5, 0.5, 0.5))


def test_every_sort_of_footprints_has_styles():
    assert all(styles.SUITING.values())
    assert len(styles.ROWS) > 3
    assert np.min([row.share for row in styles.ROWS]) > 0.0
    assert any(row.corners for row in styles.ROWS)
