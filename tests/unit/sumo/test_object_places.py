"""POIs and polygons that do not give net coordinates."""

import logging

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import read_additional, read_network

UTM = "+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
NET = (
    '<net><location netOffset="-683542.41,-4928877.56" convBoundary="0,0,2000,1500"'
    ' origBoundary="0,0,1,1" projParameter="{}"/><edge id="a">'
    '<lane id="a_0" length="40" shape="0,0 10,0 10,10"/></edge></net>'
)


def read(tmp_path, objects, projected=UTM):
    (tmp_path / "n.xml").write_text(NET.format(projected), encoding="utf-8")
    path = tmp_path / "a.xml"
    path.write_text(f"<additional>{objects}</additional>", encoding="utf-8")
    return read_additional([path], read_network(tmp_path / "n.xml"))


@pytest.mark.parametrize(
    ("words", "place"),
    [
        ('pos="0"', (0, 0)),
        ('pos="10"', (5, 0)),  # the lane's length is twice that of its shape
        ('pos="30"', (10, 5)),
        ('pos="-10"', (10, 5)),
        ('pos="99"', (10, 10)),
        ('pos="10" posLat="2"', (5, 2)),
        ('pos="30" posLat="-1"', (11, 5)),
        ("", (0, 0)),
    ],
)
def test_pois_beside_lanes(tmp_path, words, place):
    (poi,), _ = read(tmp_path, f'<poi id="p" lane="a_0" {words} key="1"/>')
    assert poi.position == pytest.approx(place)
    assert poi.params == {"key": "1"}


def test_degrees(tmp_path):
    pyproj = package("pyproj")
    x, y = np.array([[100.0, 60.0], [100.0, 90.0], [130.0, 90.0]]).T
    lon, lat = pyproj.Proj(UTM)(x + 683542.41, y + 4928877.56, inverse=True)
    shape = " ".join(f"{a:.9f},{b:.9f}" for a, b in zip(lon, lat, strict=True))
    place = f'lon="{lon[0]:.9f}" lat="{lat[0]:.9f}"'
    objects = f'<poi id="p" {place}/><poly id="q" geo="1" shape="{shape}"/>'
    (poi,), (polygon,) = read(tmp_path, objects)
    assert poi.position == pytest.approx((100, 60), abs=1e-3)
    np.testing.assert_allclose(polygon.shape, np.column_stack([x, y]), atol=1e-3)


def test_what_has_no_place_is_counted(tmp_path, caplog):
    objects = '<poi id="p" lon="1" lat="2"/><poi id="q" lane="gone_0" pos="1"/><poi id="r"/>'
    with caplog.at_level(logging.WARNING):
        pois, _ = read(tmp_path, objects, projected="!")
    assert pois == ()
    for reason in ("has no projection", "does not have their lanes", "neither x and y"):
        assert "1 POIs left out: the" in caplog.text and reason in caplog.text


def test_places_off_the_projection_are_refused(tmp_path):
    package("pyproj")
    with pytest.raises(InputError, match="does not reach"):
        read(tmp_path, '<poi id="p" lon="-80" lat="400"/>')


@pytest.mark.slow
def test_sumo_agrees(tmp_path):
    libsumo = package("libsumo")
    lines = {"p": 'pos="10" posLat="2"', "q": 'pos="-7"', "r": 'pos="33" posLat="-1.5"'}
    objects = "".join(f'<poi id="{n}" lane="a_0" {words}/>' for n, words in lines.items())
    pois, _ = read(tmp_path, objects)
    net = (tmp_path / "n.xml").read_text(encoding="utf-8")
    ends = '<junction id="{}" type="dead_end" x="{}" y="{}" incLanes="" intLanes="" shape="0,0"/>'
    net = net.replace('<edge id="a">', '<edge id="a" from="s" to="t" priority="1">')
    net = net.replace('id="a_0"', 'id="a_0" index="0" speed="9"')
    net = net.replace("</net>", ends.format("s", 0, 0) + ends.format("t", 10, 10) + "</net>")
    (tmp_path / "whole.net.xml").write_text(net.replace("<net>", '<net version="1.20">'))
    libsumo.start(
        [
            "sumo",
            "-n",
            str(tmp_path / "whole.net.xml"),
            "-a",
            str(tmp_path / "a.xml"),
            "--no-warnings",
        ]
    )
    try:
        for poi in pois:
            assert poi.position == pytest.approx(libsumo.poi.getPosition(poi.id), abs=0.01)
    finally:
        libsumo.close()
