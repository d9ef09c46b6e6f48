"""Runs: chains of lanes, stations and switches of samples, and why steps have none."""

from dataclasses import replace

import numpy as np
import pytest
from drives import Way, changing, corner, drive, network_of, road, straight

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.motion.lanes import Hop, LaneGraph, Route, Tracks
from sumo3dviz_pt.motion.path import LaneRun, expected_distances, follow, stretches_of
from sumo3dviz_pt.motion.samples import split
from sumo3dviz_pt.motion.setting import Setting


def steady(t):
    return 20.0 + 8.0 * np.asarray(t)


def samples_of(trace):
    (samples,) = split(trace, step=0.0)
    return samples


def setting_of(network, names, *, euler=False):
    return Setting(Tracks(LaneGraph(network)), tuple(names), euler)


def followed(network, names, trace):
    return follow(samples_of(trace), setting_of(network, names))


# Chains ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["straight", "corner", "roundabout", "dead end"])
@pytest.mark.parametrize("step", [0.5, 1.0, 3.0])
def test_stations_are_the_way_driven(name, step):
    network, way = road(name)
    trace = drive(way, np.arange(0.0, 21.0, step), steady)
    (run,), failed = followed(network, way.names, trace)
    assert not failed
    assert (run.first, run.last) == (0, len(trace.times) - 1)
    np.testing.assert_allclose(np.array(run.stations), steady(trace.times), atol=0.02)
    ((*chain,),) = run.chains
    passed = way.starts <= steady(trace.times[-1])
    assert [lane for lane, _ in chain] == [n for n, p in zip(way.names, passed, strict=True) if p]
    np.testing.assert_allclose([at for _, at in chain], way.starts[passed], atol=0.02)
    assert not run.switches and set(run.own) == {0}


def test_a_change_of_lanes_begins_a_chain():
    network, trace = changing(10.0, changes=(20.5, 30.5))
    (run,), failed = followed(network, ("a_0", "a_1"), trace)
    assert not failed
    assert [[lane for lane, _ in chain] for chain in run.chains] == [["a_0"], ["a_1"], ["a_0"]]
    assert [(switch.step, switch.share) for switch in run.switches] == [(20, 0.5), (30, 0.5)]
    np.testing.assert_array_equal(run.own, np.searchsorted([20.5, 30.5], trace.times))
    np.testing.assert_allclose(run.stations, 10.0 + 10.0 * trace.times, atol=1e-9)


def test_two_changes_in_one_step_share_it():
    network = straight(lanes=3)
    _, trace = changing(10.0)
    trace = replace(trace, lanes=2 * trace.lanes)
    far = trace.positions.copy()
    far[:, 1] *= 2.0
    trace = replace(trace, positions=far)
    (run,), failed = followed(network, ("a_0", "a_1", "a_2"), trace)
    assert not failed and len(run.chains) == 3
    shares = [switch.share for switch in run.switches]
    assert [switch.step for switch in run.switches] == [20, 20]
    np.testing.assert_allclose(shares, [1 / 3, 2 / 3])


def test_stations_never_fall():
    network, way = road("straight")
    trace = drive(way, np.arange(0.0, 10.0), lambda t: 20.0 + np.asarray(t))
    offsets = trace.offsets.copy()
    offsets[5] = offsets[4] - 0.2
    positions = trace.positions.copy()
    positions[5, 0] = offsets[5]
    trace = replace(trace, offsets=offsets, positions=positions)
    (run,), failed = followed(network, way.names, trace)
    assert not failed
    assert run.stations[5] == run.stations[4]
    assert (np.diff(run.stations) >= 0.0).all()


def test_beside_inside_a_junction_lanes_keep_their_share():
    # The second lane inside is half as long: what is left of it counts half.
    shapes = {
        "a_0": [(0, 0), (50, 0)],
        ":j_0_0": [(50, 0), (70, 0)],
        ":j_0_1": [(50, 3), (60, 3)],
        "b_0": [(60, 3), (90, 3)],
    }
    graph = LaneGraph(network_of(shapes))
    run = LaneRun(0, [5.0], [[(":j_0_0", 0.0)]])
    run.follow(graph, Route((Hop(":j_0_0"), Hop(":j_0_1", beside=True), Hop("b_0")), 10.0), 2.0)
    # At a quarter of the first: 7.5 m of the second are left, then 2 m.
    assert run.stations == pytest.approx([5.0, 5.0 + 7.5 + 2.0])
    assert [lane for lane, _ in run.chains[1]] == [":j_0_1", "b_0"]


# Failures ----------------------------------------------------------------------------------


def test_without_a_network_there_are_no_lanes():
    _, way = road("straight")
    trace = drive(way, np.arange(0.0, 5.0), steady)
    runs, failed = follow(samples_of(trace), Setting())
    assert runs == [] and failed == dict.fromkeys(range(4), "no lanes")


@pytest.mark.parametrize("lost", ["no lanes", "off lane"])
def test_lost_samples_part_runs(lost):
    network, way = road("straight")
    trace = drive(way, np.arange(0.0, 12.0), steady)
    gone = (trace.times >= 5) & (trace.times <= 6)
    if lost == "no lanes":
        trace = replace(trace, lanes=np.where(gone, -1, trace.lanes))
    else:
        aside = trace.positions + np.outer(gone, [0.0, 6.0, 0.0])
        trace = replace(trace, positions=aside)
    runs, failed = followed(network, way.names, trace)
    assert failed == dict.fromkeys((4, 5, 6), lost)
    assert [(run.first, run.last) for run in runs] == [(0, 4), (7, 11)]


def test_where_no_lane_leads_on_there_is_no_route():
    whole = corner()
    network = Network(whole.edges, {}, (), whole.location)
    way = Way.of(network, ("a_0", ":j_0_0", "b_0"))
    trace = drive(way, np.arange(0.0, 21.0), steady)
    runs, failed = followed(network, way.names, trace)
    assert set(failed.values()) == {"no route"}
    lanes = trace.lanes
    assert sorted(failed) == np.flatnonzero(np.diff(lanes)).tolist()
    assert runs[0].first == 0 and runs[-1].last == 20


def test_a_way_that_no_speed_explains_is_none():
    network, way = road("corner")
    trace = drive(way, np.arange(0.0, 21.0), steady)
    # It stands, says the log, and comes out of the junction all the same.
    trace = replace(trace, speeds=np.zeros(21))
    _, failed = followed(network, way.names, trace)
    assert "no route" in failed.values()


# Values ------------------------------------------------------------------------------------


def test_expected_distances():
    _, way = road("straight")
    samples = samples_of(drive(way, np.array([0.0, 1.0, 3.0, 4.0]), steady))
    samples = replace(samples, speeds=np.array([2.0, 4.0, 8.0, np.nan]))
    # A speed that is missing leaves the places: 8 m.
    np.testing.assert_allclose(expected_distances(samples, euler=True), [4.0, 16.0, 8.0])
    np.testing.assert_allclose(expected_distances(samples, euler=False), [3.0, 12.0, 8.0])


def test_stretches_are_those_of_the_lanes():
    network, way = road("corner")
    inside = network.lanes[":j_0_0"]
    edge = replace(network.edges[":j_0"], lanes=(replace(inside, length=inside.length / 1.5),))
    network = Network({**network.edges, ":j_0": edge}, {}, network.connections, network.location)
    samples = samples_of(drive(way, np.arange(0.0, 21.0), steady))
    samples = replace(samples, lanes=np.where(samples.times == 2.0, -1, samples.lanes))
    found = stretches_of(samples, setting_of(network, way.names), LaneGraph(network))
    np.testing.assert_allclose(found, np.where(samples.lanes == 1, 1.5, 1.0))
    assert (samples.lanes == 1).any()
