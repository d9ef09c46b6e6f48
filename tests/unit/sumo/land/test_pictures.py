"""Pictures of the land lie where their files say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from real_land import OFFSET, UTM, network

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import GroundPicture
from sumo3dviz_pt.model.traffic import LandFiles
from sumo3dviz_pt.sumo.land.pictures import picture_of


def colour(places: Floats) -> Floats:
    """What the land of these tests looks like, (n, 3): east, north, and a chess of 50 m."""
    x, y = places[:, 0], places[:, 1]
    chess = (np.floor(x / 50) + np.floor(y / 50)) % 2
    return np.column_stack([(x + 2000) / 16, (y + 2000) / 16, 60 + 120 * chess]).clip(0, 255)


def drawn(low: tuple[float, float], high: tuple[float, float], step: float) -> Image.Image:
    """Return the picture of a box."""
    x = np.arange(low[0], high[0], step) + step / 2
    y = np.arange(high[1], low[1], -step) - step / 2
    places = np.column_stack([each.ravel() for each in np.meshgrid(x, y)])
    return Image.fromarray(colour(places).reshape(len(y), len(x), 3).astype(np.uint8))


def off(picture: GroundPicture, *, within: tuple[float, float, float, float]) -> float:
    """Return how far a picture's chess usually is from where it belongs [m].

    The share of pixels with the wrong colour tells it: edges of the chess are 25 m from
    each other on average in either direction.
    """
    pixels = np.asarray(Image.open(picture.file).convert("RGB"))
    x0, y0, x1, y1 = picture.box
    places = np.random.default_rng(3).uniform(within[:2], within[2:], (20_000, 2))
    column = ((places[:, 0] - x0) / (x1 - x0) * pixels.shape[1]).astype(int)
    row = ((y1 - places[:, 1]) / (y1 - y0) * pixels.shape[0]).astype(int)
    wrong = np.abs(pixels[row, column, 2] - colour(places)[:, 2]) > 60
    return float(wrong.mean()) * 50.0 / 2.0


PART = (0.0, 0.0, 600.0, 500.0)


def test_corners_say_where_it_lies(tmp_path: Path) -> None:
    file = tmp_path / "a.png"
    drawn((-100, -50), (700, 550), 1.0).save(file)
    picture = picture_of(LandFiles(None, file, ((-100.0, -50.0), (700.0, 550.0))), network())
    assert picture is not None and picture.box == (-100.0, -50.0, 700.0, 550.0)
    assert off(picture, within=PART) < 0.5


def test_a_decal_of_view_settings(tmp_path: Path) -> None:
    drawn((-100, -50), (700, 550), 1.0).save(tmp_path / "air.png")
    decal = '<decal file="air.png" centerX="300" centerY="250" width="800" height="600"/>'
    view = tmp_path / "view.xml"
    view.write_text(f"<viewsettings>{decal}</viewsettings>", encoding="utf-8")
    picture = picture_of(LandFiles(None, view), network())
    assert picture is not None and off(picture, within=PART) < 0.5
    view.write_text("<viewsettings/>", encoding="utf-8")
    with pytest.raises(InputError, match="has no decal"):
        picture_of(LandFiles(None, view), network())


def test_a_world_file(tmp_path: Path) -> None:
    file = tmp_path / "a.png"
    drawn((-400, -300), (900, 800), 1.0).save(file)
    file.with_suffix(".pgw").write_text("1\n0\n0\n-1\n-399.5\n799.5\n", encoding="ascii")
    picture = picture_of(LandFiles(None, file), network())
    assert picture is not None and off(picture, within=PART) < 0.8


def test_a_geotiff_in_utm(tmp_path: Path) -> None:
    pytest.importorskip("pyproj")
    from PIL import TiffImagePlugin

    file = tmp_path / "a.tif"
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[33550], tags[33922] = (
        (1.0, 1.0, 0.0),
        (0.0, 0.0, 0.0, -400 - OFFSET[0], 800 - OFFSET[1], 0.0),
    )
    tags.tagtype[33550] = tags.tagtype[33922] = 12
    tags[34735] = (1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32632)
    tags.tagtype[34735] = 3
    drawn((-400, -300), (900, 800), 1.0).save(file, tiffinfo=tags)
    picture = picture_of(LandFiles(None, file), network(projection=UTM))
    assert picture is not None and off(picture, within=PART) < 0.8


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        (None, "says nowhere where it lies"),
        (((5.0, 5.0), (1.0, 9.0)), "south-western and the north"),
    ],
)
def test_pictures_that_lie_nowhere(tmp_path: Path, corners, words: str) -> None:
    file = tmp_path / "a.png"
    drawn((0, 0), (50, 50), 1.0).save(file)
    with pytest.raises(InputError, match=words):
        picture_of(LandFiles(None, file, corners), network())


def test_none_and_damaged(tmp_path: Path) -> None:
    assert picture_of(LandFiles(), network()) is None
    file = tmp_path / "a.png"
    file.write_bytes(b"no picture")
    with pytest.raises(InputError, match="cannot be read"):
        picture_of(LandFiles(None, file, ((0.0, 0.0), (1.0, 1.0))), network())
    with pytest.raises(InputError, match="does not exist"):
        picture_of(LandFiles(None, tmp_path / "b.png", ((0.0, 0.0), (1.0, 1.0))), network())


def test_pictures_that_say_where_they_lie_are_found(tmp_path: Path) -> None:
    from sumo3dviz_pt.sumo.land.pictures import pictures_beside

    for name in ("aerial.JPG", "plan.png", "logo.png"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "aerial.jgw").write_text("1 0 0 -1 0 0", encoding="ascii")
    (tmp_path / "plan.pgw").write_text("1 0 0 -1 0 0", encoding="ascii")
    found = [tmp_path / "aerial.JPG", tmp_path / "plan.png"]
    assert pictures_beside(tmp_path) == pictures_beside(tmp_path / "a.sumocfg") == found


@pytest.mark.parametrize("inside", [False, True], ids=["named", "in a folder"])
def test_view_settings_with_a_picture_are_found(tmp_path, inside):
    from sumo3dviz_pt.sumo.land.pictures import view_with_picture

    configuration, view = tmp_path / "a.sumocfg", tmp_path / "view.xml"
    option = '<gui_only><gui-settings-file value="view.xml"/></gui_only>'
    configuration.write_text(f"<configuration>{'' if inside else option}</configuration>")
    place = tmp_path if inside else configuration
    assert view_with_picture(place) is None, "there are none"
    view.write_text('<viewsettings><decal file="aerial.png" rotation="3"/></viewsettings>')
    Image.new("RGB", (4, 4)).save(tmp_path / "aerial.png")
    assert view_with_picture(place) is None, "turned ones cannot be laid"
    view.write_text('<viewsettings><decal file="aerial.png"/></viewsettings>')
    assert view_with_picture(place) == view
    (tmp_path / "aerial.png").unlink()
    assert view_with_picture(place) is None, "their picture is missing"
