"""Logs in longitude and latitude, or without the net's offset."""

import gzip

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt.errors import ConfigError, MissingExtraError
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import ScenarioFiles
from sumo3dviz_pt.sumo import places as projection
from sumo3dviz_pt.sumo import read_roster, read_scenario, read_trajectories
from sumo3dviz_pt.sumo.belonging import Coordinates, coordinates_of
from sumo3dviz_pt.sumo.guesses import TypesOfUsers

UTM = "+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
OFFSET = (-683542.41, -4928877.56)
HERE = Location(OFFSET, (0.0, 0.0, 2000.0, 1500.0), projection=UTM)
NET = (
    '<net><location netOffset="{},{}" convBoundary="0,0,2000,1500" origBoundary="0,0,1,1"'
    ' projParameter="{}"/><edge id="a"><lane id="a_0" shape="0,700 2000,700"/></edge></net>'
)
SAID = (
    '<?xml version="1.0"?>\n<!-- <configuration><fcd-output.{} value="true"/></configuration> -->\n'
)


def row(kind, name, x, y):
    return f'<{kind} id="{name}" x="{x}" y="{y}" angle="90" speed="20"/>\n'


def log(tmp_path, places, people=None, head="", name="log.xml"):
    """Write a vehicle at places, and a person."""
    steps = ""
    for time, (x, y) in enumerate(places):
        more = "" if people is None else row("person", "p", *people[time])
        steps += f'<timestep time="{time}">\n{row("vehicle", "v", x, y)}{more}</timestep>\n'
    path = tmp_path / name
    path.write_bytes(f"{head}<fcd-export>\n{steps}</fcd-export>".encode())
    return path


XY = np.column_stack([np.arange(100.0, 900.0, 20.0), np.full(40, 700.0)])


def degrees(location=HERE):
    pyproj = package("pyproj")
    lon, lat = pyproj.Proj(location.projection)(*(XY - location.net_offset).T, inverse=True)
    return np.round(np.column_stack([lon, lat]), 6)


def traces(path, location=HERE):
    return {t.kind: t.positions[:, :2] for t in read_trajectories([path], location=location).traces}


@pytest.mark.parametrize("head", ["", SAID.format("geo")])
def test_degrees_become_metres(tmp_path, head):
    path = log(tmp_path, degrees(), people=degrees()[::-1], head=head)
    assert set(coordinates_of(path, HERE).values()) == {Coordinates.GEO}
    found = traces(path)
    np.testing.assert_allclose(found["vehicle"], XY, atol=0.1)
    assert np.abs(found["person"] - XY[::-1]).max() < 0.1


@pytest.mark.parametrize("head", ["", SAID.format("utm")])
def test_kinds_are_shifted_each_by_itself(tmp_path, head):
    """SUMO leaves persons where they are."""
    path = log(tmp_path, XY - OFFSET, people=XY[::-1], head=head)
    assert coordinates_of(path, HERE) == {"vehicle": Coordinates.UTM}
    found = traces(path)
    np.testing.assert_allclose(found["vehicle"], XY, atol=1e-6)
    np.testing.assert_array_equal(found["person"], XY[::-1])


def test_a_small_offset_is_known_from_the_configuration(tmp_path):
    near = Location((300.0, 200.0), HERE.boundary, projection=UTM)
    path = log(tmp_path, XY - near.net_offset, head=SAID.format("utm"))
    np.testing.assert_allclose(traces(path, near)["vehicle"], XY)


@pytest.mark.parametrize("scale", [1.0, 0.05])
def test_net_coordinates_stay(tmp_path, scale):
    """Even small ones, that could be degrees, and those of a run that asked for degrees in vain."""
    path = log(tmp_path, XY * scale)
    np.testing.assert_array_equal(traces(path)["vehicle"], XY * scale)
    bare = Location(OFFSET, HERE.boundary)
    path = log(tmp_path, XY * scale, head=SAID.format("geo"))
    np.testing.assert_array_equal(traces(path, bare)["vehicle"], XY * scale)


def test_without_a_location_nothing_changes(tmp_path):
    path = log(tmp_path, XY - OFFSET)
    for location in (None, Location()):
        np.testing.assert_allclose(traces(path, location)["vehicle"], XY - OFFSET)


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    path, plain = log(tmp_path, degrees()), log(tmp_path, XY * 0.05, name="plain.xml")

    def missing(_):
        raise MissingExtraError("longitudes and latitudes need pyproj", extra="geo")

    monkeypatch.setattr(projection, "_projection", missing)
    assert coordinates_of(plain, HERE) == {}
    with pytest.raises(MissingExtraError, match=r"\[geo\]"):
        traces(log(tmp_path, degrees(), head=SAID.format("geo"), name="said.xml"))
    far = Location(OFFSET, (5000.0, 5000.0, 6000.0, 6000.0), projection=UTM)
    with pytest.raises(MissingExtraError):
        coordinates_of(path, far)


def test_scenarios_and_rosters(tmp_path):
    net = tmp_path / "n.net.xml.gz"
    net.write_bytes(gzip.compress(NET.format(*OFFSET, UTM).encode()))
    path = log(tmp_path, degrees())
    scenario = read_scenario(ScenarioFiles(net, (path,)))
    np.testing.assert_allclose(scenario.traffic.traces[0].positions[:, :2], XY, atol=0.1)
    (user,) = read_roster([path], types=TypesOfUsers({}), location=HERE)
    assert user.length == pytest.approx(780, abs=1)


def test_simple_projection():
    """The figures are those of SUMO 1.28 (`simulation.convertGeo` in a net of this projection)."""
    simple = Location((10.0, 20.0), projection="-")
    found = projection.net_from_geo(np.array([[0.02, 0.01]]), simple)
    np.testing.assert_allclose(found, [[10 + 2226.4, 20 + 1111.36]], atol=0.01)


@pytest.mark.parametrize("words", ["+proj=utm +zone=61 +ellps=WGS84", "+proj=nonsense", "words"])
def test_a_projection_that_does_not_exist_is_one_sentence(words):
    package("pyproj")
    with pytest.raises(ConfigError, match=r"projParameter=.* is no projection .* netconvert"):
        projection.net_from_geo(np.array([[2.17, 41.4]]), Location(projection=words))
