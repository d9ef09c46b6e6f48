"""Where networks lie on the Earth, and where the sun stands there."""

import datetime as dt
import math

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import SunSettings
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.sumo import read_location
from sumo3dviz_pt.sumo.places import convergence_at, middle_of, net_from_geo
from sumo3dviz_pt.world.sky import moment_of, sun_of

UTM = "+proj=utm +zone={} +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
BRUNSWICK = (
    "+proj=tmerc +lat_0=52.27732947001164 +lon_0=10.53906321682368 +k=1 +x_0=0 +y_0=0"
    " +datum=WGS84 +units=m  +vunits=m +no_defs "
)

# netOffset, convBoundary, origBoundary and projection of public networks, the town's latitude and
# longitude in gazetteers, and its zone.
NETWORKS = {
    "Ingolstadt, cut": (
        *("-464198.88,-4952821.58", "213239.67,452295.98,213518.01,452604.78"),
        *("8.520516,43.618350,29.768112,49.031374", UTM.format(32)),
        *((48.7636, 11.4261), "Europe/Berlin"),
    ),
    "Ingolstadt, station": (
        *("-672401.23,-5399632.08", "5525.68,5517.09,5934.45,5826.03"),
        *("11.274814,48.715766,11.611141,48.814343", UTM.format(32)),
        *((48.7636, 11.4261), "Europe/Berlin"),
    ),
    "Bologna": (
        *("-683542.41,-4928877.56", "0.00,0.00,1817.58,1350.19"),
        *("-346.830000,0.000000,1817.580000,2148.550000", UTM.format(32)),
        *((44.4938, 11.3387), "Europe/Rome"),
    ),
    "Barcelona": (
        *("-410839.68,-4570200.97", "17205.01,15339.58,21837.79,18824.91"),
        *("-0.645202,35.709443,11.782536,44.407854", UTM.format(31)),
        *((41.3828, 2.1769), "Europe/Madrid"),
    ),
    "Bad Hersfeld": (
        *("-543074.33,-5627577.65", "5810.75,3549.66,7661.39,7253.61"),
        *("9.611217,50.723113,9.826982,50.917305", UTM.format(32)),
        *((50.8683, 9.7067), "Europe/Berlin"),
    ),
    "Monaco": (
        *("-368142.40,-4841896.61", "35.88,594.71,3413.67,4446.29"),
        *("7.362913,43.718985,7.485778,43.776857", UTM.format(32)),
        *((43.7333, 7.4167), "Europe/Paris"),
    ),
    "Berlin-Adlershof": (
        *("-398816.96,-5809707.61", "1699.69,0.00,3978.68,1899.97"),
        *("13.510966,52.428677,13.569823,52.453865", UTM.format(33)),
        *((52.4333, 13.55), "Europe/Berlin"),
    ),
    "Brunswick": (
        *("502.65,421.95", "0.00,0.00,444.84,397.66"),
        *("0.000000,0.000000,0.000000,0.000000", BRUNSWICK),
        *((52.2667, 10.5167), "Europe/Berlin"),
    ),
    "Munich, no offset": (
        *("0.00,0.00", "691524.55,5334761.54,691896.49,5335050.50"),
        *("11.574500,48.137200,11.579500,48.139800", UTM.format(32)),
        *((48.1375, 11.575), "Europe/Berlin"),
    ),
    "Quito": (
        *("-777496.49,23956.17", "0.00,0.00,348.37,271.52"),
        *("-78.506984,-0.216532,-78.503856,-0.214078", UTM.format(17)),
        *((-0.22, -78.5125), "America/Guayaquil"),
    ),
}


def located(folder, offset="0,0", box="0,0,10,10", junk="0,0,1,1", projection="!"):
    path = folder / "a.net.xml"
    path.write_text(
        f'<net><location netOffset="{offset}" convBoundary="{box}" origBoundary="{junk}"'
        f' projParameter="{projection}"/></net>',
        encoding="utf-8",
    )
    return read_location(path)


def spencer(when, latitude, longitude):
    """The sun's height [deg] by another formula: J. W. Spencer, Search 2 (1971) 172."""
    utc = when.astimezone(dt.UTC)
    hours = utc.hour + utc.minute / 60.0
    g = 2.0 * math.pi * (utc.timetuple().tm_yday - 1 + (hours - 12.0) / 24.0) / 365.0
    declination = (
        *(0.006918 - 0.399912 * math.cos(g), 0.070257 * math.sin(g)),
        *(-0.006758 * math.cos(2 * g), 0.000907 * math.sin(2 * g)),
        *(-0.002697 * math.cos(3 * g), 0.00148 * math.sin(3 * g)),
    )
    ahead = 0.000075 + 0.001868 * math.cos(g) - 0.032077 * math.sin(g)
    ahead += -0.014615 * math.cos(2 * g) - 0.040849 * math.sin(2 * g)
    angle = math.radians(15.0 * (hours - 12.0) + longitude) + ahead
    d, lat = sum(declination), math.radians(latitude)
    up = math.sin(lat) * math.sin(d) + math.cos(lat) * math.cos(d) * math.cos(angle)
    return math.degrees(math.asin(up))


@pytest.mark.parametrize("name", NETWORKS)
def test_public_networks_lie_where_they_are_and_have_their_towns_sun(tmp_path, name):
    """Real networks fill `origBoundary` with what was cut off, or with metres."""
    *words, town, zone = NETWORKS[name]
    location = located(tmp_path, *words)
    assert location.place == pytest.approx(town, abs=0.06)
    for date in ("2026-06-21", "2026-12-21"):  # when declination stands still
        for clock in ("09:00", "13:00", "16:30"):
            asked = SunSettings.model_validate({"date": date, "time": clock})
            when = moment_of(asked, location)
            assert when.tzinfo.key == zone
            height = math.degrees(sun_of(asked, location=location).elevation)
            refraction = 0.5 if height < 5.0 else 0.15
            assert height == pytest.approx(spencer(when, *town), abs=0.25 + refraction)


def test_the_series_agrees_with_proj():
    proj = package("pyproj").Proj
    for number in range(300):
        zone, south = 1 + number % 60, number % 2 == 1
        east = 6 * zone - 183 + (number * 37 % 130) / 10.0 - 6.5
        north = (number * 53 % 830) / 10.0 * (-1 if south else 1)
        words = UTM.format(zone) + (" +south" if south else "")
        if number % 3 == 0:
            words = (
                f"+proj=tmerc +lat_0={north - 3} +lon_0={east - 4} +k=0.9999 +x_0=5 +ellps=GRS80"
            )
        x, y = proj(words)(east, north)
        found = middle_of(Location((7.0, -9.0), (x + 6, y - 10, x + 8, y - 8), words))
        assert found[0] == pytest.approx(north, abs=1e-7)
        assert (found[1] - east + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("words", ["-", "+proj=lcc +lat_1=49 +lat_2=44 +lat_0=46.5 +lon_0=3"])
def test_other_projections_come_back_to_where_they_began(words):
    if words != "-":
        package("pyproj")
    ((x, y),) = net_from_geo(np.array([[4.85, 45.76]]), Location(projection=words))
    found = middle_of(Location(boundary=(x - 1, y - 1, x + 1, y + 1), projection=words))
    assert found == pytest.approx((45.76, 4.85), abs=1e-6)


@pytest.mark.parametrize(
    ("offset", "words"),
    [
        ("0,0", "!"),
        ("0,0", UTM.format(61)),
        ("0,0", "+proj=nonsense"),
        ("0,0", "words"),
        ("0,-50000000", UTM.format(32)),
        ("0,-11000000", UTM.format(32)),
        ("-50000000,0", UTM.format(32)),
        ("0,-20000000", "-"),
    ],
)
def test_what_lies_nowhere_on_the_earth_has_no_place(tmp_path, offset, words):
    location = located(tmp_path, offset, projection=words)
    assert location.place is None
    asked = SunSettings.model_validate({"date": "2026-06-21", "time": "12:00"})
    with pytest.raises(ConfigError, match=r"sky\.sun\.place: .*give latitude and longitude"):
        sun_of(asked, location=location)


def test_the_place_that_was_taken_is_said_with_zone_and_sun(tmp_path, caplog):
    location = located(tmp_path, *NETWORKS["Bologna"][:4])
    asked = SunSettings.model_validate({"date": "2026-12-21", "time": "16:00"})
    sun_of(asked, location=location)
    assert (
        "the network's middle, 44.496° N 11.320° E: 2026-12-21 16:00 at Europe/Rome, 4.7 degrees"
        in caplog.text
    )


@pytest.mark.parametrize(
    ("words", "place", "known"),
    [
        # East of the middle meridian, north of the equator: grid north lies to the east.
        ("+proj=utm +zone=32 +ellps=WGS84", (48.137, 11.575), 1.918),
        ("+proj=utm +zone=31", (41.4, 2.15), -0.562),
        ("+proj=utm +zone=56 +south", (-33.87, 151.21), 0.998),
        ("+proj=tmerc +lon_0=9", (50.0, 10.0), 0.766),
        ("+proj=merc", (50.0, 10.0), 0.0),
        # Lambert 93: (longitude - 3 degrees) x sin 46.5 degrees, nearly the cone's constant.
        ("+proj=lcc +lat_1=49 +lat_2=44 +lat_0=46.5 +lon_0=3", (48.4, -4.5), -7.5 * 0.725604),
        # SUMO's own: a way to the north of 1 is -longitude x sin(latitude) to the east.
        ("-", (45.0, 10.0), math.degrees(math.atan(math.radians(10.0) * math.sin(math.pi / 4)))),
    ],
)
def test_grid_north(words, place, known):
    if "lcc" in words or "merc" in words:
        package("pyproj")
    found = convergence_at(place, Location(projection=words))
    assert math.degrees(found) == pytest.approx(known, abs=0.02)


def test_the_sun_is_turned_by_the_networks_own_north(tmp_path):
    """Wherever the sun is seen from, shadows fall on roads of this network."""
    location = located(tmp_path, *NETWORKS["Munich, no offset"][:4])
    asked = {"date": "2026-06-21", "time": "12:00", "zone": "UTC", "place": (52.5, 13.4)}
    sun = SunSettings.model_validate(asked)
    turned = sun_of(sun, location=None).azimuth - sun_of(sun, location=location).azimuth
    assert math.degrees(turned) == pytest.approx(1.92, abs=0.01)
