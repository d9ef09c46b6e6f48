"""Roads and land on real heights: what comes out is what the height model says."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin
from real_land import OFFSET, UTM, hill, network

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Heights, Network
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.sumo.land.heights import on_land
from sumo3dviz_pt.sumo.scenario import on_land_of


def geotiff(file: Path, *, shift: tuple[float, float], system: dict[int, int], step: float) -> Path:
    """Write heights around the network, the first row in the north; values are of middles."""
    x = np.arange(-1000.0, 1600.0, step) + step / 2
    y = np.arange(1500.0, -1000.0, -step) - step / 2
    values = hill(*np.meshgrid(x, y)).astype(np.float32)
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[33550] = (step, step, 0.0)
    tags.tagtype[33550] = tags.tagtype[33922] = 12
    tags[33922] = (0.0, 0.0, 0.0, x[0] - step / 2 + shift[0], y[0] + step / 2 + shift[1], 0.0)
    keys = [number for key, value in system.items() for number in (key, 0, 1, value)]
    tags[34735] = (1, 1, 0, len(system), *keys)
    tags.tagtype[34735] = 3
    Image.fromarray(values).save(file, tiffinfo=tags, compression="tiff_lzw")
    return file


def ascii_grid(file: Path, step: float) -> Path:
    """Write the same as a grid of ESRI."""
    x = np.arange(-1000.0, 1600.0, step)
    y = np.arange(1500.0, -1000.0, -step)
    rows = hill(*np.meshgrid(x, y))
    head = f"ncols {len(x)}\nnrows {len(y)}\nxllcenter {x[0]}\nyllcenter {y[-1]}\ncellsize {step}\n"
    text = "\n".join(" ".join(f"{value:.4f}" for value in row) for row in rows)
    file.write_text(head + "NODATA_value -9999\n" + text, encoding="ascii")
    return file


def tile(file: Path) -> Path:
    """Write a tile of SRTM with decimetres as metres, around UTM's place."""
    pyproj = pytest.importorskip("pyproj")
    side = 1201
    lon, lat = np.meshgrid(np.linspace(11, 12, side), np.linspace(49, 48, side))
    east, north = pyproj.Proj(UTM)(lon, lat)
    values = np.round(10 * hill(east + OFFSET[0], north + OFFSET[1]) - 4000).clip(-9000, 9000)
    file.write_bytes(values.astype(">i2").tobytes())
    return file


LOCAL: dict[str, Callable[[Path], Path]] = {
    "GeoTIFF": lambda folder: geotiff(folder / "a.tif", shift=(0, 0), system={1024: 1}, step=5.0),
    "ASCII grid": lambda folder: ascii_grid(folder / "a.asc", 5.0),
}


@pytest.mark.parametrize("form", LOCAL)
def test_land_is_as_the_model_says(form: str, tmp_path: Path) -> None:
    """Within 5 cm, at places between the model's own."""
    raised = on_land(network(), LOCAL[form](tmp_path))
    assert raised.heights is not None
    places = np.random.default_rng(1).uniform([-300, -300], [900, 800], (500, 2))
    base = np.floor(hill(*np.array([[0.0, 200.0], [300.0, 0.0]]).T).min())
    np.testing.assert_allclose(raised.heights.at(places), hill(*places.T) - base, atol=0.05)
    for lane in raised.lanes.values():
        np.testing.assert_allclose(lane.shape[:, 2], hill(*lane.shape[:, :2].T) - base, atol=0.05)
        assert np.linalg.norm(np.diff(lane.shape[:, :2], axis=0), axis=1).max() < 8.0
    outline = raised.junctions["a"].outline
    np.testing.assert_allclose(outline[:, 2], hill(*outline[:, :2].T) - base, atol=0.05)


def test_a_model_in_utm_lies_under_a_network_in_utm(tmp_path: Path) -> None:
    pytest.importorskip("pyproj")
    shift = (-OFFSET[0], -OFFSET[1])
    file = geotiff(tmp_path / "a.tif", shift=shift, system={1024: 1, 3072: 32632}, step=5.0)
    lane = on_land(network(projection=UTM), file).lanes["north_0"]
    np.testing.assert_allclose(
        np.diff(lane.shape[:, 2]), np.diff(hill(*lane.shape[:, :2].T)), atol=0.02
    )


def test_a_tile_in_degrees_lies_under_a_network_in_utm(tmp_path: Path) -> None:
    """SRTM's tiles hold whole metres, here of ten times the heights."""
    raised = on_land(network(projection=UTM), tile(tmp_path / "N48E011.hgt"))
    assert raised.heights is not None
    places = np.random.default_rng(2).uniform([0, 0], [600, 500], (200, 2))
    got = raised.heights.at(places)
    expected = 10 * hill(*places.T)
    assert np.abs(got - got.mean() - expected + expected.mean()).max() < 1.5


def test_roads_with_heights_keep_them(tmp_path: Path) -> None:
    own = network(z=7.0)
    raised = on_land(own, LOCAL["GeoTIFF"](tmp_path))
    assert raised.lanes is not own.lanes
    for name, lane in raised.lanes.items():
        np.testing.assert_array_equal(lane.shape, own.lanes[name].shape)
    assert raised.heights is not None and abs(raised.heights.at([[300.0, 250.0]])[0] - 7.0) < 15.0


def test_a_cliff_becomes_a_grade_that_one_can_drive(tmp_path: Path) -> None:
    """A step of 5 m across a street is a ramp."""
    x, y = np.arange(-500.0, 1100.0, 5.0), np.arange(1000.0, -500.0, -5.0)
    values = np.where(np.meshgrid(x, y)[0] > 150.0, 5.0, 0.0)
    head = f"ncols {len(x)}\nnrows {len(y)}\nxllcenter {x[0]}\nyllcenter {y[-1]}\ncellsize 5\n"
    file = tmp_path / "a.asc"
    file.write_text(head + "\n".join(" ".join(map(str, row)) for row in values), encoding="ascii")
    lane = on_land(network(), file).lanes["east_0"]
    grades = np.diff(lane.shape[:, 2]) / np.linalg.norm(np.diff(lane.shape[:, :2], axis=0), axis=1)
    assert 0.04 < grades.max() < 0.13 and np.ptp(lane.shape[:, 2]) == pytest.approx(5.0, abs=0.1)


def test_a_model_of_another_place_is_refused(tmp_path: Path) -> None:
    file = geotiff(tmp_path / "a.tif", shift=(90_000, 0), system={1024: 1}, step=20.0)
    with pytest.raises(InputError, match=r"heights of only 0 % of the roads .* of this place"):
        on_land(network(), file)


def test_degrees_need_a_projection(tmp_path: Path) -> None:
    file = geotiff(tmp_path / "a.tif", shift=(0, 0), system={1024: 2, 2048: 4326}, step=20.0)
    with pytest.raises(
        InputError, match=r"degrees, and the network has no projection; .*--proj.utm"
    ):
        on_land(network(), file)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.txt", b"nothing", "is no height model; give a GeoTIFF"),
        ("a.tif", b"II*\0" + struct.pack("<I", 8), "cannot be read"),
        (
            "a.asc",
            b"ncols 2\nnrows 2\ncellsize 1\n1 2 3",
            r"ASCII grid \(it has 3 heights, and its head promises 4 \(2 rows of 2\)\)",
        ),
        ("a.hgt", b"\0\0" * 9, "is no tile of SRTM"),
    ],
)
def test_damaged_models_are_refused(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(InputError, match=words):
        on_land(network(), file)


def test_a_picture_that_lies_nowhere(tmp_path: Path) -> None:
    file = tmp_path / "a.tif"
    Image.fromarray(np.zeros((4, 4), np.float32)).save(file)
    with pytest.raises(InputError, match="says nowhere where it lies"):
        on_land(network(), file)
    file.with_suffix(".tfw").write_text("500\n0\n0\n-500\n-500\n1500\n", encoding="ascii")
    assert on_land(network(), file).heights is not None


def test_heights_are_bilinear_and_end() -> None:
    grid = Heights((10.0, 20.0), (2.0, 5.0), np.array([[0.0, 2.0], [10.0, 12.0]]))
    np.testing.assert_allclose(grid.at([[10, 20], [12, 25], [11, 22.5]]), [0.0, 12.0, 6.0])
    assert np.isnan(grid.at([[9.9, 20.0], [11.0, 25.1]])).all()
    np.testing.assert_allclose(grid.share([[11.0, 22.5], [0.0, 0.0]], fade=2.0), [0.5, 0.0])


def stacked() -> Network:
    """Return the two streets, one of which crosses 6 m above the other."""
    flat = network()
    lane = flat.edges["north"].lanes[0]
    y = np.array([0.0, 100.0, 160.0, 240.0, 300.0, 500.0])
    shape = np.column_stack([np.full(6, 300.0), y, [0.0, 0.0, 6.0, 6.0, 0.0, 0.0]])
    north = replace(flat.edges["north"], lanes=(replace(lane, shape=shape),))
    return replace(flat, edges={**flat.edges, "north": north}, junctions={})


def trace(places: Floats) -> Trace:
    """Return somebody who was at places."""
    count = len(places)
    zeros, unknown = np.zeros(count), np.full(count, -1)
    times = np.arange(float(count))
    return Trace("a", "vehicle", "", times, places, zeros, zeros, zeros, unknown, unknown)


def test_bridges_by_layers_stand_above_the_land(tmp_path: Path) -> None:
    """netconvert makes z of layers: on a model of 500 m, all roads lay 500 m below the land."""
    file = LOCAL["GeoTIFF"](tmp_path)
    raised = on_land(stacked(), file)
    base = np.floor(hill(*np.array([[0.0, 200.0], [300.0, 0.0]]).T).min())
    for lane in raised.lanes.values():
        x, y, z = lane.shape.T
        bridge = np.interp(y, [100.0, 160.0, 240.0, 300.0], [0.0, 6.0, 6.0, 0.0], left=0, right=0)
        own = bridge if lane.id == "north_0" else 0.0
        np.testing.assert_allclose(z, hill(x, y) - base + own, atol=0.05)
    above = np.array([[300.0, 200.0, 6.0], [300.0, 50.0, 0.0]])
    below = np.array([[300.0, 200.0, 0.0]])
    traces = tuple(map(trace, (above, below)))
    for own, made in zip((above, below), on_land_of(traces, raised), strict=True):
        expected = hill(*own[:, :2].T) - base + own[:, 2]
        np.testing.assert_allclose(made.positions[:, 2], expected, atol=0.05)


def test_another_zero_is_said_and_taken_off(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Heights above the ellipsoid and above the sea differ by up to 100 m."""
    flat = network()
    lanes = {name: edge.lanes[0] for name, edge in flat.edges.items()}
    edges = {}
    for name, lane in lanes.items():
        z = hill(*lane.shape[:, :2].T) - 48.0
        shape = np.column_stack([lane.shape[:, :2], z])
        edges[name] = replace(flat.edges[name], lanes=(replace(lane, shape=shape),))
    own = replace(flat, edges=edges, junctions={})
    made = on_land(own, LOCAL["GeoTIFF"](tmp_path))
    assert made.lanes == own.lanes and "another zero" in caplog.text
    assert made.heights is not None
    for lane in own.lanes.values():
        np.testing.assert_allclose(made.heights.at(lane.shape), lane.shape[:, 2], atol=0.1)
