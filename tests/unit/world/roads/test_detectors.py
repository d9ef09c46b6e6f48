"""Loops of detectors: only on request, within their lanes; what has no body is named."""

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.job.settings import ObjectsSettings, RoadSettings
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Loop, Scenario, TrafficLog
from sumo3dviz_pt.sumo.additional import read_detectors
from sumo3dviz_pt.world.placement.lanes import build_lane_index
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.roads.detectors import build_loops
from sumo3dviz_pt.world.roads.roads import build_roads

FILE = """<additional>
<inductionLoop id="a" lane="e_0" pos="30" period="9" file="x"/>
<e1Detector id="b" lane="e_1" pos="-20" period="9" file="x"/>
<laneAreaDetector id="c" lane="e_0" pos="50" length="12" period="9" file="x"/>
<e2Detector id="d" lanes="e_0 e_1" pos="60" endPos="80" period="9" file="x"/>
<rerouter id="r" edges="e"/><calibrator id="k" edge="e" pos="0"/><rerouter id="s" edges="e"/>
<entryExitDetector id="z" period="9" file="x"><detEntry lane="e_0" pos="1"/></entryExitDetector>
<variableSpeedSign id="v" lanes="e_0"/><busStop id="h" lane="e_0"/></additional>"""


def test_detectors_are_read_and_what_steers_is_counted(tmp_path):
    path = tmp_path / "a.add.xml"
    path.write_text(FILE)
    loops, unseen = read_detectors([path])
    assert [(k.id, k.lane, k.at) for k in loops] == [
        ("a", "e_0", 30.0),
        ("b", "e_1", -20.0),
        *(("c", "e_0", at) for at in (50.0, 62.0)),
        *(("d", lane, at) for lane, at in (("e_0", 60.0), ("e_1", 80.0))),
    ]
    assert unseen == {
        "rerouters": 2,
        "calibrators": 1,
        "entry-exit detectors": 1,
        "variable speed signs": 1,
    }
    path.write_text(FILE.replace('pos="30"', 'pos="x"'))
    with pytest.raises(InputError, match=r'inductionLoop "a".*pos'):
        read_detectors([path])


def scenario(*loops, climb=0.0):
    cars = frozenset({"passenger"})
    lanes = tuple(
        Lane(f"e_{k}", "e", k, np.array([(0, y, 0), (100, y, climb)]), 3.2, 13.9, 100.0, cars)
        for k, y in enumerate((-4.8, -1.6))
    )
    ends = {k: Junction(k, "dead_end", np.zeros(3), np.zeros((0, 3))) for k in "ab"}
    net = Network({"e": Edge("e", "normal", "a", "b", lanes)}, ends, (), Location())
    log = TrafficLog((), (), 0.0, 0.0, 0.0)
    return Scenario(net, log, loops=loops, unseen={"rerouters": 2})


def built(given, *, drawn=True):
    roads = build_roads(given.network, RoadSettings(), textured=False)
    lanes = build_lane_index(given.network)
    path = CameraPath.all_round(np.array([[50.0, -20.0, 9.0]]))
    around = surroundings(lanes, seed=1, camera_path=path)
    return build_loops(given, ObjectsSettings(detectors=drawn), roads, around)


@pytest.mark.parametrize("climb", [0.0, 6.0])
def test_loops_lie_in_their_lanes_just_above_the_asphalt(climb):
    made = built(scenario(Loop("a", "e_0", 30.0), Loop("b", "e_1", -20.0), climb=climb))
    (part,) = made.static
    points, faces = part.part.mesh.vertices, part.part.mesh.faces
    shape = shapely.union_all(shapely.buffer(shapely.polygons(points[faces][..., :2]), 0.001))
    boxes = [piece.bounds for piece in shapely.get_parts(shape)]
    assert len(boxes) == 2
    for (x0, y0, x1, y1), at, middle in zip(sorted(boxes), (30, 80), (-4.8, -1.6), strict=True):
        assert (x0, x1) == (pytest.approx(at - 0.9, abs=0.05), pytest.approx(at + 0.9, abs=0.05))
        assert middle - 1.61 <= y0 and y1 <= middle + 1.05
    above = points[:, 2] - climb / 100.0 * points[:, 0]
    assert (above > 0.002).all() and (above < 0.02).all()


def test_nothing_is_sawn_unless_somebody_asks_and_all_of_it_is_named():
    loops = (Loop("a", "e_0", 30.0), Loop("b", "nowhere_0", 3.0))
    silent = built(scenario(*loops), drawn=False)
    assert not silent.static
    assert [out.what for out in silent.left_out] == ["2 rerouters", "2 detector loops"]
    assert [out.what for out in built(scenario(*loops)).left_out] == ["2 rerouters"]
    assert not built(scenario()).static
