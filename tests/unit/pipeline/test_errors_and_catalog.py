"""Errors are one sentence with a place; names are found and suggested."""

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError, InputError, RenderError, Sumo3dvizError


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (InputError("is bad"), "is bad"),
        (InputError("is bad", file="a.xml", line=3), "a.xml:3: is bad"),
        (InputError("is bad", file="a.xml", element="lane"), "a.xml: lane: is bad"),
        (InputError("is bad", line=3), "is bad"),
        (ConfigError("is bad", key="a.b"), "a.b: is bad"),
        (ConfigError("is bad", file="s", line=1, column=2, key="k"), "s:1:2: k: is bad"),
        (RenderError("is bad"), "is bad"),
    ],
)
def test_messages(error, text):
    assert str(error) == text and isinstance(error, Sumo3dvizError)


def test_assets_are_found_and_suggested():
    for family in ("vehicles", "surfaces", "skies"):
        for name in catalog.names(family):
            entry = catalog.find(family, name)
            assert (entry.family, entry.name) == (family, name)
            assert (entry.folder / "asset.yaml").is_file() and entry.meta
    with pytest.raises(ConfigError, match="did you mean 'ground_grass'"):
        catalog.find("surfaces", "ground_gras")
    with pytest.raises(ConfigError, match="known: "):
        catalog.find("surfaces", "zzz")
    assert catalog.names("nothing") == ()
    assert catalog.did_you_mean("a", ()) == ""


def test_templates_and_data():
    assert {"highway_day", "abstract"} <= set(catalog.template_names("scene"))
    with pytest.raises(ConfigError, match="no quality preset is called 'nice'"):
        catalog.template("quality", "nice")
    with pytest.raises(ConfigError, match="installation is incomplete"):
        catalog.data_root("no such folder")


def test_a_variation_holds_what_its_base_says():
    taxi = catalog.find("vehicles", "taxi")
    base = catalog.find("vehicles", taxi.meta["base"])
    assert (taxi.meta["length"], taxi.meta["build"]) == (base.meta["length"], base.meta["build"])
    assert taxi.meta["vclass"] != base.meta["vclass"]
    files = catalog.recipe_files(taxi)
    assert files == (taxi.folder / "asset.yaml", base.folder / "asset.yaml")
    assert all(path.is_file() for path in files)
    assert catalog.recipe_files(base) == (base.folder / "asset.yaml",)


def test_cache_lies_with_the_user_unless_told_otherwise(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "here"))
    assert catalog.cache_root() == tmp_path / "here"
    assert not (tmp_path / "here").exists(), "asking makes no folder"
    for unset in (lambda name: monkeypatch.setenv(name, ""), monkeypatch.delenv):
        unset("SUMO3DVIZ_PT_CACHE")
        assert catalog.cache_root().name == "sumo3dviz_pt"
        assert not catalog.cache_root().is_relative_to(tmp_path)


def test_tests_keep_out_of_the_users_cache(own_cache):
    assert catalog.cache_root() == own_cache


def test_own_code_is_found():
    assert (catalog.package_folder("library") / "mesh" / "__init__.py").is_file()
