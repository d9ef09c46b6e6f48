"""Maps become networks and traffic by SUMO's own programs."""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.pipeline.reading import read_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.recording import maps
from sumo3dviz_pt.recording.maps import is_map, make_of_map
from sumo3dviz_pt.sumo.network import read_network
from sumo3dviz_pt.sumo.repairs import crossings_at_grade

needs_sumo = pytest.mark.skipif(
    find_spec("sumo") is None and shutil.which("netconvert") is None, reason="needs SUMO"
)
_CROSSING = example("crossing").parent / "crossing.net.xml.gz"


def town(file: Path) -> Path:
    """Write a map of OpenStreetMap: four blocks of streets, houses between them."""
    nodes: list[tuple[float, float]] = []
    ways: list[tuple[list[int], dict[str, str]]] = []

    def node(row: float, column: float) -> int:
        nodes.append((52.5 + 0.0011 * row, 13.4 + 0.0017 * column))
        return len(nodes)

    grid = [[node(row, column) for column in range(3)] for row in range(3)]
    for n in range(3):
        street = {"highway": "residential", "sidewalk": "both", "name": f"Street {n}"}
        ways.append((grid[n], street))
        ways.append(([row[n] for row in grid], {"highway": "tertiary", "name": f"Road {n}"}))
    for row, column in ((0.3, 0.3), (1.3, 0.3), (0.3, 1.3), (1.3, 1.3)):
        corners = [(0, 0), (0, 0.25), (0.3, 0.25), (0.3, 0)]
        own = [node(row + up, column + right) for up, right in corners]
        ways.append((own + own[:1], {"building": "yes", "building:levels": "4"}))
    text = ['<osm version="0.6">']
    text += [
        f'<node id="{number}" lat="{lat:.7f}" lon="{lon:.7f}" version="1"/>'
        for number, (lat, lon) in enumerate(nodes, start=1)
    ]
    for number, (refs, tags) in enumerate(ways, start=1):
        text.append(f'<way id="{number}" version="1">')
        text += [f'<nd ref="{ref}"/>' for ref in refs]
        text += [f'<tag k="{key}" v="{value}"/>' for key, value in tags.items()]
        text.append("</way>")
    file.write_text("\n".join([*text, "</osm>", ""]), encoding="utf-8")
    return file


def test_maps_are_told_by_content(tmp_path):
    assert is_map(town(tmp_path / "a.xml"))
    assert not is_map(_CROSSING) and not is_map(tmp_path)


def test_nobody_drives_on_a_map(tmp_path):
    with pytest.raises(ConfigError, match=r"nobody drives on a map; .*--traffic 600"):
        make_of_map(town(tmp_path / "a.osm"), tmp_path / "made", traffic=None)


def test_traffic_is_invented_on_maps_only(tmp_path, capsys):
    assert main(["init", str(tmp_path), "--traffic", "60", "-o", str(tmp_path / "s.yaml")]) == 2
    assert "traffic is invented on a map (.osm) only" in capsys.readouterr().err


def test_without_sumo_the_command_is_said(tmp_path, monkeypatch):
    """Where SUMO is not installed, what to type elsewhere is."""
    monkeypatch.setattr(maps, "sumo_program", _no_program)
    file = town(tmp_path / "a.osm")
    with pytest.raises(InputError, match=r"there is no SUMO here; .*netconvert --osm-files"):
        make_of_map(file, tmp_path / "made", traffic=60.0)
    assert not (tmp_path / "made").exists()


def _no_program(name: str = "sumo") -> str:
    from sumo3dviz_pt.errors import InstallationError

    raise InstallationError("there is no SUMO here; install it with: pip install eclipse-sumo")


@needs_sumo
@pytest.mark.slow
def test_a_map_of_openstreetmap_becomes_a_scene_with_traffic(tmp_path, capsys):
    file, scene = town(tmp_path / "town.osm"), tmp_path / "scene.yaml"
    assert main(["init", str(file), "--traffic", "60", "-o", str(scene)]) == 0
    _, scenario = read_files(load_job(scene))
    kinds = {trace.kind for trace in scenario.traffic.traces}
    assert "vehicle" in kinds and len(scenario.traffic.traces) > 3
    assert any(lane.allowed == {"pedestrian"} for lane in scenario.network.lanes.values())
    assert sum(1 for each in scenario.polygons if "building" in each.type) == 4
    assert "next: sumo3dviz-pt check" in capsys.readouterr().out


def two_roads(file: Path, *, joined: bool = True, height: str = "") -> Path:
    """Write a map with a bridge over a street; a ring road joins the two, or nothing does."""
    places = [(0, -40), (0, -8), (0, 8), (0, 40), (-20, 0), (20, 0)]
    text = ['<osm version="0.6">']
    for number, (north, east) in enumerate(places, start=1):
        lat, lon = 48.15 + 1e-4 * north, 11.57 + 1e-4 * east
        text.append(
            f'<node id="{number}" lat="{lat:.5f}" lon="{lon:.5f}" version="1">{height}</node>'
        )
    ways = [((1, 2), ()), ((2, 3), (("bridge", "yes"), ("layer", "1"))), ((3, 4), ())]
    ways += [((5, 6), ()), *([((1, 5, 4, 6, 1), ())] if joined else [])]
    for number, (refs, tags) in enumerate(ways, start=1):
        text.append(f'<way id="{number}" version="1"><tag k="highway" v="tertiary"/>')
        text += [f'<nd ref="{ref}"/>' for ref in refs]
        text += [f'<tag k="{key}" v="{value}"/>' for key, value in tags]
        text.append("</way>")
    file.write_text("\n".join([*text, "</osm>", ""]), encoding="utf-8")
    return file


@needs_sumo
def test_a_bridge_without_heights_lies_above_what_it_crosses(tmp_path):
    """By its layer, on ramps that one can drive; measured heights stay as they are."""
    made = make_of_map(two_roads(tmp_path / "a.osm"), tmp_path / "a", traffic=None, driven=True)
    network = read_network(made.network)
    assert not crossings_at_grade(network)
    lines = [lane.shape for lane in network.lanes.values()]
    steps = np.concatenate([np.diff(line, axis=0) for line in lines])
    assert max(line[:, 2].max() for line in lines) > 4.5
    along = np.linalg.norm(steps[:, :2], axis=1)
    assert (np.abs(steps[:, 2]) <= 0.12 * along + 0.02).all()
    high = two_roads(tmp_path / "b.osm", height='<tag k="ele" v="500"/>')
    network = read_network(make_of_map(high, tmp_path / "b", traffic=None, driven=True).network)
    assert {float(z) for lane in network.lanes.values() for z in lane.shape[:, 2]} == {500.0}


@needs_sumo
def test_roads_that_nothing_joins_are_kept_where_there_are_no_others(tmp_path):
    file = two_roads(tmp_path / "a.osm", joined=False)
    made = make_of_map(file, tmp_path / "made", traffic=60.0)
    assert made.simulation is not None and made.simulation.is_file()
    assert len(read_network(made.network).edges) >= 4


@needs_sumo
def test_a_map_without_streets_is_refused_in_one_sentence(tmp_path):
    file = tmp_path / "a.osm"
    file.write_text('<osm version="0.6"><node id="1" lat="48" lon="11"/></osm>', encoding="utf-8")
    with pytest.raises(InputError, match=r"a.osm: .*no street; give a map"):
        make_of_map(file, tmp_path / "made", traffic=60.0)


@needs_sumo
def test_opendrive_keeps_its_places(tmp_path):
    """A network that went through OpenDRIVE has its lanes where they were."""
    import gzip
    import subprocess

    from sumo3dviz_pt.recording.run import sumo_program

    plain = tmp_path / "own.net.xml"
    plain.write_bytes(gzip.decompress(_CROSSING.read_bytes()))
    drawn = tmp_path / "map.xodr"
    command = [sumo_program("netconvert"), "-s", str(plain), "--opendrive-output", str(drawn)]
    subprocess.run(command, check=True, capture_output=True)
    assert is_map(drawn)
    with pytest.raises(ConfigError, match="maps of OpenStreetMap only"):
        make_of_map(drawn, tmp_path / "made", traffic=60.0)
    made = read_network(make_of_map(drawn, tmp_path / "made", traffic=None).network)
    shift = np.array(made.location.net_offset) - read_network(plain).location.net_offset
    boxes = [
        np.concatenate([lane.shape[:, :2] for lane in each.lanes.values()])
        for each in (read_network(plain), made)
    ]
    for of in (np.min, np.max):
        np.testing.assert_allclose(of(boxes[0], axis=0), of(boxes[1], axis=0) - shift, atol=3.0)


@needs_sumo
def test_a_broken_map_has_netconverts_words(tmp_path):
    file = tmp_path / "map.xodr"
    file.write_text("<OpenDRIVE><road/></OpenDRIVE>", encoding="utf-8")
    with pytest.raises(InputError, match="netconvert stopped"):
        make_of_map(file, tmp_path / "made", traffic=None)
    assert not (tmp_path / "made").exists()


@needs_sumo
def test_nothing_is_replaced_unasked(tmp_path):
    folder = tmp_path / "made"
    folder.mkdir()
    with pytest.raises(ConfigError, match="made: exists; --overwrite replaces it"):
        make_of_map(town(tmp_path / "a.osm"), folder, traffic=60.0)
