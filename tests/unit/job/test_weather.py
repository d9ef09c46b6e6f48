"""Settings of the weather: quantities with units, presets, and moments in order."""

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.surroundings import WeatherSettings
from sumo3dviz_pt.pipeline.scene_file import make_job

SCENE = {"scenario": {"network": "net.xml"}}


def weather(**settings):
    """The weather of a scene file."""
    return make_job({**SCENE, "weather": settings}).weather


def test_quantities_have_units():
    found = weather(
        fog={"visibility": "0.2 km", "height": 60},
        rain={"rate": "10 mm/h"},
        snow={"depth": "3 cm", "falling": "1 mm/h"},
        wind={"speed": "18 km/h", "from": 90},
    )
    assert (found.fog.visibility, found.fog.height) == (200.0, 60.0)
    assert found.rain.rate == 10.0 and found.snow.depth == pytest.approx(0.03)
    assert (found.wind.speed, found.wind.bearing) == (5.0, 90.0)


def test_a_scene_without_weather_has_none():
    assert make_job(SCENE).weather is None


def test_keys_beside_a_preset_win():
    found = weather(preset="fog", fog={"visibility": "120 m"}, wetness=0.4)
    assert (found.fog.visibility, found.fog.height) == (120.0, 60.0)
    assert found.wetness == 0.4 and found.puddles == 0.0


def test_a_key_of_a_preset_can_be_taken_away():
    assert weather(preset="drizzle", fog=None).fog is None


@pytest.mark.parametrize("preset", catalog.template_names("weather"))
def test_every_preset_is_a_weather(preset):
    assert weather(preset=preset) != WeatherSettings(preset=preset)


@pytest.mark.parametrize(
    ("settings", "key", "word"),
    [
        ({"preset": "frog"}, "weather.preset", "did you mean 'fog'"),
        ({"fog": {"visibility": "2 m"}}, "weather.fog.visibility", "10 to 100000 m"),
        ({"rain": {"rate": "10 m"}}, "weather.rain.rate", "mm/h"),
        ({"wetness": 1.5}, "weather.wetness", "1"),
        ({"rain": {"rates": 1}}, "weather.rain.rates", "did you mean"),
        ({"course": [{"time": 4}, {"time": 4}]}, "weather", "follow each other"),
    ],
)
def test_wrong_settings_are_told_by_key(settings, key, word):
    with pytest.raises(ConfigError) as told:
        weather(**settings)
    assert key in str(told.value) and word in str(told.value)
