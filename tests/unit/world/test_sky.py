import datetime as dt

import numpy as np
import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.job.settings import SkySettings
from sumo3dviz_pt.library.pictures import stored_clouds
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.world.sky import KINDS, SkyPreset, base_exposure, build_sky, read_clouds

PRESETS = catalog.template_names("sky")
BARCELONA = Location(place=(41.4, 2.15), convergence=np.radians(-0.562))
NOON = {"date": dt.date(2026, 6, 21), "time": dt.time(12, 0), "zone": "solar"}


def degrees(sky):
    east, north, up = sky.sun_direction
    return np.degrees(np.arctan2(east, north)) % 360, np.degrees(np.arcsin(up))


def test_the_promised_presets_exist():
    founding = {"sky_blue", "sky_halloween"}
    founding |= {f"sky_daycloud{k}" for k in (1, 2, 3)} | {f"sky_night{k}" for k in (1, 2, 3)}
    assert founding | {"sky_overcast", "sky_dawn", "sky_golden", "sky_dusk"} <= set(PRESETS)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_build(name):
    sky = build_sky(SkySettings(preset=name))
    assert np.linalg.norm(sky.sun_direction) == pytest.approx(1)
    assert 1 <= sky.turbidity <= 10 and 0 <= sky.exposure < 13.5 and sky.image is None
    assert SkyPreset(**catalog.template("sky", name)).purpose


@pytest.mark.parametrize(
    ("number", "low", "high"), [(1, 0.1, 0.35), (2, 0.25, 0.6), (3, 0.7, 0.95)]
)
def test_cloud_layers_have_their_characters(number, low, high):
    layer, sun = read_clouds(f"sky_daycloud{number}")
    rows, columns = layer.cover.shape
    assert columns == 4 * rows and layer.sunlit.shape == layer.skylit.shape == (rows, columns)
    assert layer.cover.min() >= 0 and layer.cover.max() <= 1
    assert layer.sunlit.min() >= 0 and layer.sunlit.max() < 12
    weight = np.sin((np.arange(rows) + 0.5) / rows * np.pi / 2)[:, None]
    assert low < float((layer.cover * weight).sum() / (weight.sum() * columns)) < high
    row = int((1 - sun.elevation / (np.pi / 2)) * rows)
    column = int(sun.azimuth / (2 * np.pi) * columns)
    around = layer.cover[row - 3 : row + 4, column - 3 : column + 4]
    assert around.max() < 0.15 if number < 3 else around.min() > 0.5
    # The horizon is clear and there is no seam at north.
    assert layer.cover[-2:].max() < 0.05
    inside = np.abs(np.diff(layer.cover, axis=1)).mean(axis=0).max()
    assert np.abs(layer.cover[:, 0] - layer.cover[:, -1]).mean() <= inside + 1e-6


def rings(cover, *, low, high):
    """Rows of a layer between two elevations [deg], and the rows' elevations [rad]."""
    elevation = np.pi / 2 * (1 - (np.arange(len(cover)) + 0.5) / len(cover))
    chosen = (elevation > np.radians(low)) & (elevation < np.radians(high))
    return cover[chosen], elevation[chosen]


@pytest.mark.parametrize("name", ["sky_daycloud1", "sky_daycloud2", "sky_daycloud3", "sky_veil"])
def test_edges_of_clouds_are_soft(name):
    """From a tenth to nine tenths of their opacity most take half a degree or more."""
    cover = read_clouds(name)[0].cover
    rows, columns = cover.shape
    part, high = rings(cover, low=10, high=60)
    down = np.gradient(part, axis=0) * rows / 90
    across = (np.roll(part, -1, 1) - np.roll(part, 1, 1)) / 2 * columns / 360
    steep = np.hypot(down, across / np.cos(high)[:, None])[(part > 0.4) & (part < 0.6)]
    assert np.quantile(0.8 / np.maximum(steep, 1e-3), 0.2) > 0.45


@pytest.mark.parametrize("name", ["sky_daycloud1", "sky_daycloud2", "sky_daycloud3"])
def test_clouds_do_not_stand_in_rows(name):
    """Around the sky nothing comes again: no second peak of the autocorrelation is high."""
    cover = read_clouds(name)[0].cover
    for low in (9, 16, 26):
        part = rings(cover, low=low, high=low + 1)[0]
        part = part - part.mean(axis=1, keepdims=True)
        power = (np.abs(np.fft.rfft(part, axis=1)) ** 2).sum(axis=0)
        alike = np.fft.irfft(power)[: cover.shape[1] // 2]
        ends = int(np.argmax(alike < 0.0))
        assert alike[ends:].max() < 0.45 * alike[0]


NIGHTS = ("sky_night1", "sky_night2", "sky_night3")


def test_three_nights_differ():
    stars, moon, town = (build_sky(SkySettings(preset=name)) for name in NIGHTS)
    assert stars.stars is not None and stars.moon_direction is None and stars.clouds is None
    assert moon.moon_direction is not None and moon.moon_direction[2] > 0.5
    assert town.moon_direction is None and min(town.glow) > 5 * max(stars.glow)
    assert all(sky.sun_direction[2] < np.sin(np.radians(-18)) for sky in (stars, moon, town))


@pytest.mark.parametrize("name", NIGHTS)
def test_by_day_nothing_of_the_night_is_built(name):
    sky = build_sky(SkySettings(preset=name, sun={"azimuth": 90, "elevation": 20}))
    assert sky.stars is None and sky.moon_direction is None and max(sky.glow) == 0


def test_clouds_are_lit_from_the_moons_side():
    layer, lit_by = read_clouds("sky_daycloud1")
    sky = build_sky(SkySettings(preset="sky_night2"))
    east, north, _ = sky.moon_direction
    turned = np.arctan2(east, north) - lit_by.azimuth
    assert np.cos(sky.rotation - turned) == pytest.approx(1)
    assert layer.lit_from == pytest.approx(lit_by.elevation)


def test_a_clear_night_by_angles_has_stars():
    assert build_sky(SkySettings(sun={"azimuth": 0, "elevation": -20})).stars is not None
    assert build_sky(SkySettings(sun={"azimuth": 0, "elevation": -4})).stars is None


def test_nothing_said_means_the_default():
    assert degrees(build_sky(SkySettings())) == pytest.approx((150, 52))


def test_sun_by_angles():
    sky = build_sky(SkySettings(sun={"azimuth": 270, "elevation": 10}, turbidity=5))
    assert degrees(sky) == pytest.approx((270, 10))
    assert sky.turbidity == 5 and sky.clouds is None


def test_sun_by_clock_takes_the_networks_place():
    here = build_sky(SkySettings(sun=NOON), location=BARCELONA)
    there = build_sky(SkySettings(sun={**NOON, "place": (41.4, 2.15)}))
    # Grid north lies 0.56 degrees west of true north, 0.85 degrees west of zone 31's middle.
    known = np.add(degrees(there), (0.85 * np.sin(np.radians(41.4)), 0.0))
    assert degrees(here) == pytest.approx(known, abs=1e-3)
    assert degrees(here)[1] == pytest.approx(90 - 41.4 + 23.44, abs=0.1)
    assert degrees(here)[0] == pytest.approx(180, abs=2)


@pytest.mark.parametrize("zone", ["+02:00", "Europe/Madrid", None])
def test_clocks_mean_what_they_show(zone):
    """At noon by Barcelona's clocks the sun stands where it stands at 10:00 UTC."""
    summer = build_sky(SkySettings(sun={**NOON, "zone": zone}), location=BARCELONA)
    utc = {"date": NOON["date"], "time": dt.time(10, 0), "zone": "UTC"}
    assert degrees(summer)[0] < 120
    assert degrees(summer) == pytest.approx(
        degrees(build_sky(SkySettings(sun=utc), location=BARCELONA))
    )


@pytest.mark.parametrize("location", [None, Location()])
def test_clock_without_place_is_an_error(location):
    with pytest.raises(ConfigError, match=r"sky\.sun\.place: .*latitude"):
        build_sky(SkySettings(sun=NOON), location=location)


def test_clouds_are_known_by_their_file_and_their_sun(tmp_path):
    path = tmp_path / "clouds.exr"
    keys = []
    for content in (b"one", b"other"):
        path.write_bytes(content)
        keys += [stored_clouds(path, lit_from=lit).key for lit in (0.5, 0.6, 0.5)]
    assert keys[0] == keys[2] and len(set(keys)) == 4
    with pytest.raises(InputError, match="cannot be read"):
        stored_clouds(tmp_path / "none.exr", lit_from=0.5)


def test_clouds_turn_with_the_sun():
    layer, lit_by = read_clouds("sky_daycloud1")
    azimuth = float(np.degrees(lit_by.azimuth)) + 30
    settings = SkySettings(
        preset="sky_daycloud1", sun={"azimuth": azimuth, "elevation": 40}, rotation=10
    )
    sky = build_sky(settings)
    assert np.degrees(sky.rotation) == pytest.approx(40)
    assert degrees(sky) == pytest.approx((azimuth, 40))
    assert np.array_equal(sky.clouds.cover, layer.cover)


def test_map_from_a_file(tmp_path):
    image = np.full((16, 32, 3), 3.1 / np.pi, np.float32)
    for name, factor in (("a.exr", 1.0), ("b.exr", 4.0)):
        write_exr(tmp_path / name, {"radiance": factor * image}, half=False)
    sky, brighter = (build_sky(SkySettings(file=tmp_path / f"{x}.exr", rotation=90)) for x in "ab")
    assert sky.sun_direction is None and sky.image.shape == (16, 32, 3)
    assert sky.rotation == pytest.approx(np.pi / 2)
    assert sky.exposure == pytest.approx(base_exposure(np.pi / 2), abs=0.02)
    assert brighter.exposure == pytest.approx(sky.exposure - 2)
    scaled = build_sky(SkySettings(file=tmp_path / "a.exr", scale=2))
    assert (scaled.image_scale, scaled.exposure) == (2, sky.exposure)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"preset": "sky_blue", "file": "a.exr"}, "either preset or file"),
        ({"preset": "sky_blue", "scale": 2}, "only a sky from a file"),
        ({"file": "a.exr", "turbidity": 3}, "own sun and haze"),
        ({"preset": "sky_bleu"}, "did you mean 'sky_blue'"),
    ],
)
def test_contradictions_are_one_sentence(settings, message):
    with pytest.raises(ConfigError, match=message):
        build_sky(SkySettings(**settings))


@pytest.mark.parametrize(
    ("content", "message"),
    [({"mooon": 1}, "mooon"), ({"turbidity": 3.0}, "neither sun nor clouds")],
)
def test_bad_presets_are_named(monkeypatch, content, message):
    monkeypatch.setattr(catalog, "template", lambda kind, name: content)
    with pytest.raises(ConfigError, match=message):
        build_sky(SkySettings(preset="mine"))


def test_exposure_falls_smoothly_with_the_sun():
    elevations = np.radians(np.linspace(-90, 90, 721))
    values = np.array([base_exposure(elevation) for elevation in elevations])
    steps = np.diff(values)
    assert steps.max() <= 1e-12 and steps.min() > -0.35
    assert values[0] == pytest.approx(12.0) and values[-1] == pytest.approx(0.4)


def test_kinds_are_settings():
    assert set(KINDS) <= set(SkySettings.model_fields)
