"""Laws of street furniture, for any straight town."""

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.job.settings import StreetSettings
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Poi, Scenario, Stop, TrafficLog
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.street.places import Site, crossing_areas
from sumo3dviz_pt.world.street.street import build_street

WIDTH = {"f": 2.4, "b": 1.6, "c": 3.2}
ALLOWED = {
    "f": frozenset({"pedestrian"}),
    "b": frozenset({"bicycle"}),
    "c": frozenset({"passenger", "bus"}),
}
EDGES = st.lists(
    st.tuples(
        st.tuples(st.floats(-200, 200), st.floats(-200, 200)),
        st.floats(0.0, 6.28),
        st.floats(20.0, 260.0),
        st.sampled_from(["c", "fc", "fbc", "fcc", "bcc", "cccc"]),
        st.sampled_from([8.3, 13.9, 27.8]),
    ),
    min_size=1,
    max_size=5,
)


def town(edges, left):
    """Roads that may cross each other anywhere."""
    made = {}
    for number, (begin, yaw, length, kinds, speed) in enumerate(edges):
        along = np.array([np.cos(yaw), np.sin(yaw)])
        inward = np.array([-along[1], along[0]]) * (-1.0 if left else 1.0)
        lanes, at = [], 0.0
        for i, kind in enumerate(kinds):
            start = np.array(begin) + (at + WIDTH[kind] / 2) * inward
            shape = np.column_stack([[start, start + length * along], np.zeros(2)])
            lanes.append(
                Lane(f"e{number}_{i}", f"e{number}", i, shape, WIDTH[kind], speed, length,
                     ALLOWED[kind])
            )  # fmt: skip
            at += WIDTH[kind]
        edge = Edge(f"e{number}", "normal", f"a{number}", f"b{number}", tuple(lanes))
        made[edge.id] = edge
    return Network(made, {}, (), Location(), left)


@pytest.mark.slow
@settings(deadline=None, max_examples=tries(40))
@given(EDGES, st.booleans(), st.integers(0, 5), st.booleans())
# A bench at a POI whose end reached over a lane that begins beside it.
@example([((38.5, 0.0), 0.0, 20.0, "fc", 8.3), ((39.0, 0.0), 0.0, 20.0, "c", 8.3)], False, 0, False)
def test_nothing_stands_on_a_lane_that_is_driven_on(edges, left, seed, dark):
    net = town(edges, left)
    around = surroundings(net, seed=seed, viewpoints=np.array([[0.0, 0.0, 40.0]]))
    site = Site(
        around,
        lambda places: np.zeros(len(places)),
        crossing_areas(net),
        np.zeros((0, 2)),
        shapely.STRtree([]),
    )
    first = edges[0]
    pois = [Poi(f"p{k}", kind, first[0], None, None, "x") for k, kind in
            enumerate(["street_lamp", "bench", "bollard"])]  # fmt: skip
    stops = [Stop("s", f"e0_{len(first[3]) - 1}")]
    scenario = Scenario(
        net, TrafficLog((), (), 0.0, 0.0, 0.0), pois=tuple(pois), stops=tuple(stops)
    )
    parts = build_street(scenario, StreetSettings(), site=site, dark=dark)
    for part in parts.static:
        spots = part.part.mesh.vertices
        low = spots[(spots[:, 2] < 2.0) & (spots[:, 2] > -0.05)]
        assert not around.index.covers(low[:, :2]).any(), part.id
