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
