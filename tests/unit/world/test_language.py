"""Which language shops speak where a network lies."""

import sys

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.world.build import language_at


@pytest.mark.parametrize(
    ("place", "language"),
    [
        (None, "english"),
        ((52.52, 13.4), "german"),
        ((45.46, 9.19), "italian"),
        ((50.06, 19.94), "polish"),
        ((40.71, -74.0), "english"),
        ((0.0, -30.0), "english"),
    ],
)
def test_place_tells_language(place, language):
    assert language_at(Location(place=place)) == language


def test_words_never_hang_on_what_is_installed(monkeypatch):
    monkeypatch.setitem(sys.modules, "tzfpy", None)
    with pytest.raises(ConfigError, match="tzfpy"):
        language_at(Location(place=(52.52, 13.4)))
