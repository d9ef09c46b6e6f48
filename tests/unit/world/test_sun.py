import datetime as dt
import math

import numpy as np
import pytest

from sumo3dviz_pt.model.numbers import zone_named
from sumo3dviz_pt.world.sky import direction_of, local_time, sun_position, zone_at

PLACES = {
    "Munich": (48.137, 11.575),
    "Quito": (-0.18, -78.47),
    "Sydney": (-33.87, 151.21),
    "Tromso": (69.65, 18.96),
    "Barcelona": (41.39, 2.17),
}


def michalsky(when, latitude, longitude):
    """Azimuth and elevation [deg] by another algorithm (Solar Energy 40, 227, 1988)."""
    start = dt.datetime(2000, 1, 1, 12, tzinfo=dt.UTC)
    n = (when - start).total_seconds() / 86400
    utc = when.astimezone(dt.UTC)
    hour = utc.hour + utc.minute / 60 + utc.second / 3600
    mean_longitude = 280.460 + 0.9856474 * n
    g = math.radians(357.528 + 0.9856003 * n)
    ecliptic = math.radians(mean_longitude + 1.915 * math.sin(g) + 0.020 * math.sin(2 * g))
    tilt = math.radians(23.439 - 0.0000004 * n)
    ascension = math.atan2(math.cos(tilt) * math.sin(ecliptic), math.cos(ecliptic))
    declination = math.asin(math.sin(tilt) * math.sin(ecliptic))
    sidereal = math.radians(15 * (6.697375 + 0.0657098242 * n + hour)) + math.radians(longitude)
    h, lat = sidereal - ascension, math.radians(latitude)
    up = math.sin(lat) * math.sin(declination) + math.cos(lat) * math.cos(declination) * math.cos(h)
    east = -math.cos(declination) * math.sin(h)
    north = math.cos(lat) * math.sin(declination)
    north -= math.sin(lat) * math.cos(declination) * math.cos(h)
    return math.degrees(math.atan2(east, north)) % 360, math.degrees(math.asin(up))


def degrees(when, place, **options):
    found = sun_position(
        when, latitude=math.radians(place[0]), longitude=math.radians(place[1]), **options
    )
    return math.degrees(found.azimuth), math.degrees(found.elevation)


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("date", ["1999-08-11", "2013-03-20", "2026-06-21", "2026-12-21"])
def test_agrees_with_another_algorithm(place, date):
    for hour in range(0, 24, 3):
        when = dt.datetime.fromisoformat(f"{date}T{hour:02}:17:30+00:00")
        azimuth, elevation = degrees(when, place, refraction=False)
        other_azimuth, other_elevation = michalsky(when, *place)
        assert elevation == pytest.approx(other_elevation, abs=0.02)
        turn = (azimuth - other_azimuth + 180) % 360 - 180
        assert abs(turn) * math.cos(math.radians(elevation)) < 0.02


@pytest.mark.parametrize("year", [1955, 1987, 2000, 2026, 2049])
def test_agrees_to_a_tenth_of_a_degree_over_years_latitudes_and_hours(year):
    worst = 0.0
    for number in range(160):
        when = dt.datetime(year, 1, 1, tzinfo=dt.UTC) + dt.timedelta(hours=number * 54.7)
        place = (-66.0 + (number * 37) % 137, -180.0 + (number * 83) % 360)
        azimuth, elevation = degrees(when, place, refraction=False)
        other_azimuth, other_elevation = michalsky(when, *place)
        turn = abs((azimuth - other_azimuth + 180) % 360 - 180)
        across = turn * math.cos(math.radians(elevation))
        worst = max(worst, abs(elevation - other_elevation), across)
    assert worst < 0.1


def test_nrels_worked_example():
    # Reda and Andreas, NREL/TP-560-34302, appendix A.5: topocentric, without refraction
    # 39.872 deg, with it (at 820 hPa) 39.888 deg, azimuth 194.340 deg.
    when = dt.datetime(2003, 10, 17, 12, 30, 30, tzinfo=dt.timezone(dt.timedelta(hours=-7)))
    azimuth, elevation = degrees(when, (39.742476, -105.1786), refraction=False)
    assert azimuth == pytest.approx(194.340, abs=0.02)
    assert elevation == pytest.approx(39.872, abs=0.02)
    assert degrees(when, (39.742476, -105.1786))[1] == pytest.approx(39.888, abs=0.02)


def test_solstice_noon_in_the_north():
    when = dt.datetime(2026, 6, 21, 12, 2, tzinfo=dt.UTC)
    azimuth, elevation = degrees(when, (51.4779, 0.0))
    assert elevation == pytest.approx(90 - 51.4779 + 23.436, abs=0.03)
    assert azimuth == pytest.approx(180, abs=0.8)


def test_refraction_lifts_the_setting_sun():
    when = dt.datetime(2026, 9, 23, 6, 0, tzinfo=dt.UTC)
    place = (0.0, 0.0)
    lifts = []
    for minutes in range(-30, 60, 1):
        moment = when + dt.timedelta(minutes=minutes - 8)
        bare = degrees(moment, place, refraction=False)[1]
        lifts.append((bare, degrees(moment, place)[1] - bare))
    at_horizon = min(lifts, key=lambda pair: abs(pair[0]))
    assert at_horizon[1] == pytest.approx(0.48, abs=0.03)
    assert all(0 <= lift < 0.7 for _, lift in lifts)
    risen = [bare + lift for bare, lift in lifts]
    assert np.all(np.diff(risen) > 0)


BERLIN = {"latitude": 52.52, "longitude": 13.405}


@pytest.mark.parametrize(
    ("zone", "utc"),
    [
        (None, "2026-06-21T15:30"),
        ("Europe/Berlin", "2026-06-21T15:30"),
        ("+02:00", "2026-06-21T15:30"),
        ("-0330", "2026-06-21T21:00"),
        ("UTC", "2026-06-21T17:30"),
        ("solar", "2026-06-21T16:36:23"),
    ],
)
def test_clock_time_of_zones(zone, utc):
    when = local_time(dt.date(2026, 6, 21), dt.time(17, 30), zone=zone, **BERLIN)
    off = when.astimezone(dt.UTC) - dt.datetime.fromisoformat(utc + "+00:00")
    assert abs(off.total_seconds()) < 1


@pytest.mark.parametrize(
    ("month", "rise", "sets"), [(6, (4, 43), (21, 33)), (12, (8, 15), (15, 54))]
)
def test_berlins_sun_rises_and_sets_by_its_clocks(month, rise, sets):
    """As almanacs print it, to the minute, in summer and winter time.

    The upper limb touches the horizon then: the middle is 0.27 degrees lower. The sun climbs
    0.12 degrees a minute at most. By mean solar time it would be 10 degrees lower in June.
    """
    for clock in (rise, sets):
        when = local_time(dt.date(2026, month, 21), dt.time(*clock), zone=None, **BERLIN)
        elevation = degrees(when, (BERLIN["latitude"], BERLIN["longitude"]))[1]
        assert elevation == pytest.approx(-0.27, abs=0.15)


@pytest.mark.parametrize(
    ("place", "zone"),
    [
        ((41.39, 2.17), "Europe/Madrid"),
        ((-33.87, 151.21), "Australia/Sydney"),
        ((27.7, 85.3), "Asia/Kathmandu"),
        ((0.0, -150.0), "Etc/GMT+10"),
    ],
)
def test_zones_of_places(place, zone):
    assert zone_at(latitude=place[0], longitude=place[1]) == zone


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Europe/Berln", "did you mean 'Europe/Berlin'"),
        ("+15:00", "no clock is further"),
        ("summer", "write it like|did you mean"),
        ("../Berlin", "write it like|did you mean"),
        ("", "write it like"),
    ],
)
def test_zones_that_do_not_exist(name, said):
    with pytest.raises(ValueError, match=said):
        zone_named(name)


def test_clock_time_and_direction():
    when = local_time(dt.date(2026, 6, 21), dt.time(17, 30), zone="+02:00", **BERLIN)
    assert when.astimezone(dt.UTC) == dt.datetime(2026, 6, 21, 15, 30, tzinfo=dt.UTC)
    assert direction_of(math.pi / 2, 0.0) == pytest.approx([1, 0, 0], abs=1e-12)
    assert direction_of(0.0, math.pi / 2) == pytest.approx([0, 0, 1], abs=1e-12)
    evening = sun_position(when, latitude=math.radians(48), longitude=math.radians(11))
    assert evening.direction[0] < 0 < evening.direction[2]
    assert np.linalg.norm(evening.direction) == pytest.approx(1)
