"""Thinned logs hold what SUMO would have written; no simulator is needed."""

from pathlib import Path

import numpy as np
import pytest
from bench.motion_nets import crossing, motorway, pairs
from bench.motion_truth import SCENARIOS, Drive, read_truth, write_log

from sumo3dviz_pt.sumo import read_trajectories


def braking(name: str = "v", *, begin: float = 60.0) -> Drive:
    """Eastwards from 20 m/s with 2 m/s2, into the next lane after four seconds."""
    own = np.arange(251) * 0.04
    ways = 20.0 * own - own**2
    lanes = np.where(own < 4.0, "e_0", "e_1")
    return Drive(
        name, "car", begin + own, np.column_stack([100.0 + ways, 3.2 * (own >= 4.0)]),
        np.full(251, 90.0), 20.0 - 2.0 * own, ways, ways, lanes,
    )  # fmt: skip


@pytest.mark.parametrize(("stride", "step"), [(3, 0.12), (12, 0.48), (25, 1.0), (50, 2.0)])
def test_a_log_keeps_every_so_many_steps(tmp_path: Path, stride: int, step: float) -> None:
    drive, path = braking(), tmp_path / "fcd.xml"
    write_log([drive, braking("w", begin=60.04)], path, stride=stride, euler=False)
    log = read_trajectories([path])
    assert log.step == pytest.approx(step)
    trace = log.traces[0]
    kept = drive.kept(stride)
    assert trace.times == pytest.approx(drive.times[kept], abs=1e-9)
    assert np.abs(trace.positions[:, :2] - drive.positions[kept]).max() <= 0.0051
    assert trace.speeds == pytest.approx(drive.speeds[kept], abs=0.0051)
    assert trace.yaws == pytest.approx(0.0, abs=1e-9)
    assert {log.lane_names[lane] for lane in trace.lanes} == {"e_0", "e_1"}


def test_speeds_of_eulers_kind_are_way_over_time(tmp_path: Path) -> None:
    write_log([braking()], tmp_path / "fcd.xml", stride=25, euler=True)
    (trace,) = read_trajectories([tmp_path / "fcd.xml"]).traces
    assert trace.speeds == pytest.approx([20.0, *(20.0 - 2 * np.arange(0.5, 10.0))], abs=0.0051)


def test_lane_changes_are_found_by_lane_and_by_jump() -> None:
    assert braking().changes == pytest.approx([64.0])


def test_truth_is_read_back_with_turns_unwrapped(tmp_path: Path) -> None:
    head = "time;id;x;y;angle;speed;pos;lane;type;odometer"
    lines = [f"{60 + 0.04 * n:.2f};a;{n};0;{(350 + n) % 360};1;{n};e_0;car;{n}" for n in range(200)]
    lines += [
        "61.00;short;0;0;0;1;0;e_0;car;0",
        "61.04;short;1;0;0;1;0;e_0;car;1",
        "61.08;;;;;;;;;",
    ]
    (tmp_path / "truth.csv").write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    (drive,) = read_truth(tmp_path / "truth.csv")
    assert drive.id == "a"
    assert np.diff(drive.angles) == pytest.approx(1.0)
    assert drive.ways[-1] == 199.0


def test_scenarios_differ_and_some_are_held_out() -> None:
    assert len({each.name for each in SCENARIOS}) == len(SCENARIOS)
    held = [each for each in SCENARIOS if each.held_out]
    assert len(held) >= 3
    assert not {each.seed for each in held} & {each.seed for each in SCENARIOS} - {
        each.seed for each in held
    }


def test_towns_name_only_nodes_that_they_have() -> None:
    for town in (crossing(radii=(5.0, 4.0)), motorway(lanes=3, speed=30.0, bend=500.0, ramp=50.0)):
        assert {end for street in town.streets for end in (street.a, street.b)} == set(town.nodes)
    assert ("a_b", "b_c", "", 1.0) in pairs({"a": "b", "c": "b"})
