"""What `check` and a film's account say of the weather."""

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.surroundings import WeatherSettings
from sumo3dviz_pt.pipeline.accounts import preset_weather, weather_account, weather_report
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.world.weather import weather_course


def report(**weather):
    """Of a scene in a weather."""
    job = make_job(
        {"scenario": {"network": "net.xml"}, **({"weather": weather} if weather else {})}
    )
    return weather_report(job)


def test_a_scene_without_weather_leaves_all_of_it_out():
    found = report()
    assert str(found) == "dry and clear summer" and found.as_dict()["moments"] == []
    assert "fog" in found.left_out and "snow on the ground" in found.left_out


def test_what_there_is_is_told_with_units():
    found = report(fog={"visibility": 200, "height": 60}, rain={"rate": 5}, wind={"speed": 4})
    for words in ("visibility 200 m", "above 60 m", "rain of 5 mm/h", "4.0 m/s from 270"):
        assert words in str(found)
    assert set(found.left_out) == {"snow on the ground", "falling snow"}


def test_a_course_is_told_moment_by_moment():
    moments = [{"time": 10, "rain": {"rate": 0}}, {"time": 20, "rain": {"rate": 4}}]
    found = report(course=moments)
    assert str(found).startswith("10 s: ") and "20 s: rain of 4 mm/h" in str(found)
    assert [moment["time"] for moment in found.as_dict()["moments"]] == [10.0, 20.0]


def test_an_account_has_units_in_its_keys():
    course = weather_course(
        WeatherSettings.model_validate(
            {
                "fog": {"visibility": 100},
                "snow": {"depth": "3 cm"},
                "wind": {"speed": 2, "from": 30},
            }
        )
    )
    found = weather_account(course.first)
    assert found["fog"] == {"visibility_m": 100.0}
    assert found["extinction_per_km"] == pytest.approx(39.12, abs=0.01)
    assert found["snow"]["depth_cm"] == 3.0
    assert found["wind"] == {"speed_m_per_s": 2.0, "from_deg": 30.0}


@pytest.mark.parametrize("name", catalog.template_names("weather"))
def test_every_preset_can_be_asked_for(name):
    assert str(
        weather_report(make_job({"scenario": {"network": "n.xml"}, "weather": {"preset": name}}))
    )
    assert preset_weather(name).preset == name
