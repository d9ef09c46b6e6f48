"""The sun's angles, as `check` prints them and `scene.sun` gives them."""

import datetime as dt
import json

import pytest
from builders import network_xml, write_scenario

import sumo3dviz_pt as sv
from sumo3dviz_pt.cli import main

CLOCK = 'sky: {sun: {date: 2026-06-21, time: "17:30", %s}}\n'


def scene_with(folder, text):
    scene = write_scenario(folder)
    scene.write_text(scene.read_text(encoding="utf-8") + text, encoding="utf-8")
    return scene


def test_check_prints_the_suns_angles_and_its_moment(tmp_path, capsys):
    scene = scene_with(tmp_path, CLOCK % "place: [52.52, 13.405]")
    assert main(["check", str(scene)]) == 0
    assert (
        "sun      azimuth 265.8°, 33.2° above the horizon:"
        " 2026-06-21 17:30 Europe/Berlin (15:30 UTC) at 52.520° N 13.405° E\n"
    ) in capsys.readouterr().out
    assert main(["check", str(scene), "--json"]) == 0
    sun = json.loads(capsys.readouterr().out)["sun"]
    assert sun["zone"] == "Europe/Berlin" and sun["time"] == "2026-06-21T17:30:00+02:00"
    assert sun["elevation"] == pytest.approx(33.24, abs=0.05)


def test_the_place_may_be_the_networks(tmp_path):
    scene = scene_with(tmp_path, CLOCK % "zone: solar")
    text = network_xml().replace('projParameter="!"', 'projParameter="+proj=utm +zone=33"')
    text = text.replace('netOffset="0,0"', 'netOffset="-391779.3,-5820072.8"')
    (tmp_path / "net.net.xml").write_text(text, encoding="utf-8")
    sun = sv.load(scene).sun
    assert sun.elevation == pytest.approx(23.18, abs=0.1) and sun.zone == "mean solar time"
    by_clock = sv.load(scene, {"sky.sun.zone": "null"}).sun
    assert by_clock.elevation == pytest.approx(33.24, abs=0.1)
    assert by_clock.when.utcoffset() == dt.timedelta(hours=2)
    assert by_clock.place == pytest.approx((52.52, 13.405), abs=1e-3)


@pytest.mark.parametrize(
    ("sky", "said"),
    [
        ("{preset: sky_blue}", "azimuth 150.0°, 52.0° above the horizon"),
        ("{preset: sky_night1}", "azimuth 330.0°, 32.0° below the horizon"),
        ("{sun: {azimuth: 370, elevation: 5}}", "azimuth 10.0°, 5.0° above the horizon"),
        ("{file: sky.exr}", "None"),
    ],
)
def test_suns_by_angles(tmp_path, sky, said):
    assert str(sv.load(scene_with(tmp_path, f"sky: {sky}\n")).sun) == said


def test_presets_tell_the_sun_that_their_clouds_bring(tmp_path):
    sun = sv.load(scene_with(tmp_path, "sky: {preset: sky_daycloud1}\n")).sun
    assert 0 <= sun.azimuth < 360 and 20 < sun.elevation < 70 and sun.when is None


@pytest.mark.parametrize(
    ("sun", "said"),
    [
        ('{date: 2026-06-21, time: "17:30", zone: Europe/Belin}', "did you mean 'Europe/Berlin'"),
        ("{azimuth: 3, elevation: 4, zone: UTC}", "a zone goes with date and time"),
        ('{date: 2026-06-21, time: "17:30+02:00"}', "a time is written like"),
    ],
)
def test_zones_are_checked_with_the_file(tmp_path, sun, said):
    with pytest.raises(sv.ConfigError, match=said) as refused:
        sv.load(scene_with(tmp_path, f"sky: {{sun: {sun}}}\n"))
    assert "sky.sun" in str(refused.value)


def test_offsets_need_no_quotes_in_yaml(tmp_path):
    sun = sv.load(scene_with(tmp_path, CLOCK % "zone: +02:00, place: [52.52, 13.405]")).sun
    assert sun.when.utcoffset() == dt.timedelta(hours=2)
