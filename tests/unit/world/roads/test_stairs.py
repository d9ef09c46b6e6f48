"""Stairs: treads on the slopes that OpenStreetMap calls steps, and the height of people on them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.network import Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT
from sumo3dviz_pt.world.roads.stairs import stairs_of

NEAR = (0.0, 0.0, 10.0, 10.0)


def network(shape, *, type_="highway.steps", back=False):
    points = np.array(shape, dtype=np.float64)
    edges = {}
    for name, line in (("up", points), ("down", points[::-1]))[: 1 + back]:
        length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
        lane = Lane(f"{name}_0", name, 0, line, 2.0, 1.5, length, frozenset({"pedestrian"}))
        edges[name] = Edge(name, "normal", "a", "b", (lane,), type_)
    ends = {k: Junction(k, "priority", points[0], np.zeros((0, 3))) for k in "ab"}
    return Network(edges, ends, (), Location())


def treads(mesh):
    """Heights of what faces up, by where it begins along x."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    up = normal[:, 2] > 0.99 * np.linalg.norm(normal, axis=1)
    return a[up][:, 2], np.stack([a, b, c])[:, up, 0].min(axis=0)


@pytest.mark.parametrize("turned", [False, True])
def test_steps_climb_from_the_foot_to_the_head_in_even_risers(turned):
    shape = [(0.0, 0.0, 1.0), (8.0, 0.0, 4.2)]
    stairs = stairs_of(network(shape[::-1] if turned else shape), NEAR)
    heights, begins = treads(stairs.mesh)
    levels = np.unique(heights.round(6))
    assert levels[-1] == pytest.approx(4.2 + SIDEWALK_HEIGHT)
    assert np.diff(levels) == pytest.approx(3.2 / 20)
    assert (np.diff(heights[np.argsort(begins, kind="stable")]) > -1e-9).all()


@given(st.floats(0.6, 12.0), st.floats(2.0, 30.0))
def test_people_stand_at_the_mean_of_treads_which_are_never_below_the_slope(climb, length):
    stairs = stairs_of(network([(0.0, 0.0, 0.0), (length, 0.0, climb)]), NEAR)
    flat = climb <= 0.05 * length
    assert bool(stairs.flights) != flat
    if flat:
        return
    heights, begins = treads(stairs.mesh)
    assert (heights - SIDEWALK_HEIGHT > climb / length * begins - 1e-6).all()
    rise = stairs.walked_on(lambda points: np.full(len(points), SIDEWALK_HEIGHT))
    middle, beside = rise(np.array([[length / 2, 0.0], [length / 2, 3.0]]))
    riser = 2.0 * (middle - SIDEWALK_HEIGHT)
    assert riser == pytest.approx(np.diff(np.unique(heights.round(6)), prepend=0.12)[0], abs=1e-5)
    assert beside == SIDEWALK_HEIGHT


def test_both_directions_are_one_flight_and_other_slopes_have_none():
    shape = [(0.0, 0.0, 0.0), (6.0, 0.0, 3.0), (8.0, 0.0, 3.0), (8.0, 6.0, 0.0)]
    one, both = (stairs_of(network(shape, back=back), NEAR) for back in (False, True))
    assert len(one.flights) == len(both.flights) == 2
    assert not stairs_of(network(shape, type_="highway.footway"), NEAR).flights
    assert not stairs_of(network(shape), None).flights
    assert not stairs_of(network(np.add(shape, (900.0, 0.0, 0.0))), NEAR).flights
