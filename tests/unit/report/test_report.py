"""What `check --motion` says, and the picture of `motion`."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib import image

from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.report.motion import (
    SPEEDS,
    Drive,
    Extreme,
    MotionCourse,
    MotionFinding,
    MotionReport,
    PopUps,
    Road,
    UserGroup,
    in_words,
    motion_plot,
)


def finding(name, kind="acceleration", *, value=4.0, time=3.0, end=3.0):
    return MotionFinding(name, kind, time, value, "w_0", 12.0, -4.8, 0.0, end)


def report(**changes):
    extreme = Extreme("acceleration", "m/s2", 2.5, (finding("v0", value=-7.25),))
    nothing = Extreme("jerk", "m/s3", float("nan"), ())
    made = MotionReport(
        smoother="lane",
        fps=25.0,
        begin=0.0,
        end=12.0,
        step=1.0,
        groups=(UserGroup("vehicle", 2, 24.0, (extreme, nothing), 3, 0),),
        births=1,
        deaths=2,
        pop_ups=(PopUps("post", 4.0, 5.0, (finding("v1", "birth", value=31.4),), ()),),
        speeds="instant",
        remarks=(
            finding("v0", "parking", value=3.2, time=2.0, end=5.0),
            finding("v1", "no route", value=8.0, time=6.0, end=7.0),
            finding("v1", "steep", value=np.pi / 4, time=3.0, end=4.0),
            finding("v1", "lane change", value=3.2, time=8.0, end=12.0),
        ),
    )
    return replace(made, **changes)


def test_words_hold_ids_times_and_places():
    words = in_words(report())
    for part in (
        "smoother lane, measured at 25 fps",
        "0 to 12 s every 1 s: 2 vehicles",
        SPEEDS["instant"],
        "births   1 within the log; deaths 2",
        "post, 4 to 5 s: 1 appear in the picture, 0 vanish",
        "v1 appears at 3 s, 31 m away, on w_0 at 12.0, -4.8",
        "v0, 2 to 5 s: 3.20 m, on w_0 at 12.0, -4.8",
        "no route       1 time, 1 road user, 1.0 s together (no route between two lanes fits",
        "lane change    1 time, 1 road user, 4.0 s together",
        "v1, 6 to 7 s: 8.00 s, on w_0",
        "v1, 3 to 4 s: 45°, on w_0",
        "3 frames with a jump",
        "acceleration: 99 % below 2.5 m/s2; largest",
        "-7.25 m/s2  v0 at 3.00 s, on w_0 at 12.0, -4.8",
    ):
        assert part in words
    assert "jerk" not in words and "no number" not in words


def test_broken_frames_are_told():
    group = replace(report().groups[0], broken=4)
    assert "4 frames with a value that is no number" in in_words(report(groups=(group,)))


def test_long_lists_are_cut_and_the_largest_come_first():
    many = tuple(finding(f"v{n}", "gap", value=float(n), time=1.0, end=2.0) for n in range(30))
    words = in_words(report(remarks=many))
    assert "v29, 1 to 2 s: 29.00 s" in words and "v3," not in words
    assert "and 25 more (--json lists them)" in words


def test_json_knows_no_nan():
    content = json.loads(json.dumps(report().as_dict(), allow_nan=False))
    assert content["groups"][0]["extremes"][1]["p99"] is None
    assert [remark["kind"] for remark in content["remarks"]] == [
        "parking", "no route", "steep", "lane change"
    ]  # fmt: skip


def course(times, places, *, extra):
    speeds = np.full(len(times), 5.0)
    nothing = np.zeros(len(times)) if extra else np.empty(0)
    offsets = np.sin(times)
    return MotionCourse(times, places, np.zeros(len(times)), speeds, offsets, nothing, nothing)


@pytest.mark.parametrize("towards", [(1.0, 0.0), (0.6, 0.8), (0.0, 0.0)])
def test_plot_of_any_shape(towards, tmp_path):
    """Wide, square, and of somebody who never moves; with a gap."""
    times, samples = np.linspace(0.0, 20.0, 500), np.arange(0.0, 21.0)
    shown = course(times, 5.0 * times[:, None] * np.array(towards), extra=True)
    shown.places[100:120] = shown.yaws[100:120, None] = np.nan
    drive = Drive(
        "vehicle v0",
        "car",
        shown,
        course(samples, 5.0 * samples[:, None] * np.array(towards), extra=False),
        [Road(np.array([[-50.0, 0.0], [150.0, 0.0]]), 3.2, inside) for inside in (True, False)],
        [Remark("lane change", 3.0, 7.0, 3.2), Remark("something new", 9.0, 9.0)],
        (4.6, 1.8),
    )
    motion_plot(drive, tmp_path / "a.png")
    pixels = image.imread(tmp_path / "a.png")[..., :3]
    assert min(pixels.shape[:2]) > 700 and (pixels < 0.8).any(axis=-1).mean() > 0.01
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_plot_of_a_single_sample(tmp_path):
    times = np.array([4.0, 4.0])
    shown = course(times, np.array([[3.0, 4.0]] * 2), extra=True)
    logged = course(times[:1], np.array([[3.0, 4.0]]), extra=False)
    motion_plot(Drive("person p", "", shown, logged, [], [], (0.5, 0.5)), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000
