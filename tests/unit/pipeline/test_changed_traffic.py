"""Recorded traffic with other gaps, paces and densities."""

import logging
from itertools import pairwise

import numpy as np
import pytest
from builders import fcd_xml, write_scenario

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.reading import read, read_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.foresight import subject_of_pair
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.run import StudyOrder, check_study, plan_in_words

# Cars v0, v2, v4 drive one behind the other at 10 m/s, 18 m apart and 4.6 m long; v0 is last.


@pytest.fixture
def scene(tmp_path):
    return write_scenario(tmp_path)


def asked(scene, **traffic):
    """The trajectories from 4 to 6 s with changed traffic, by id."""
    _, _, found = read(load_job(scene, {"traffic": traffic} if traffic else {}), begin=4.0, end=6.0)
    return {each.id: each for each in found}


def ride(**edit):
    return {"rides": {"v0": edit}}


def east(trajectory, time):
    return trajectory.at(time).position[0]


def test_a_ride_comes_later(scene):
    found = asked(scene, **ride(delay="0.5 s"))
    assert east(found["v0"], 5.0) == pytest.approx(-40 + 10 * 4.5, abs=0.01)
    assert east(found["v2"], 5.0) == pytest.approx(-40 + 18 + 50, abs=0.01)


@pytest.mark.parametrize("gap", [0.3, 0.8, 2.5, 6.0])
@pytest.mark.parametrize(("moves", "stays"), [("self", "v2"), ("behind", "v0"), ("auto", "v0")])
def test_a_gap_is_kept_from_rear_to_front_whoever_moves(scene, gap, moves, stays):
    """A camera rides with v0, so that by itself the one ahead moves, and the film's view stays."""
    found = asked(scene, **ride(behind="v2", gap=gap, at=5.0, moves=moves), leave_out=["v4"])
    rear = east(found["v2"], 5.0) - 4.6
    assert east(found["v0"], 5.0 + gap) == pytest.approx(rear, abs=0.01)
    assert east(found[stays], 5.0) == pytest.approx({"v0": 10.0, "v2": 28.0}[stays], abs=0.01)


def test_the_one_behind_moves_where_no_camera_rides_with_it(scene):
    found = asked(scene, rides={"v2": {"behind": "v4", "gap": 1.0, "at": 5.0}})
    assert east(found["v4"], 5.0) == pytest.approx(46.0, abs=0.01)
    assert east(found["v2"], 6.0) == pytest.approx(46.0 - 4.6, abs=0.01)


def test_a_pace_leaves_one_moment_as_it_is(scene):
    found = asked(scene, **ride(pace=1.2, around=5.0))
    assert east(found["v0"], 5.0) == pytest.approx(-40 + 50, abs=0.01)
    assert east(found["v0"], 6.0) == pytest.approx(-40 + 50 + 12, abs=0.05)
    assert found["v0"].at(5.5).speed == pytest.approx(12.0, abs=0.1)


def test_gap_and_pace_go_together(scene):
    found = asked(scene, **ride(behind="v2", gap="1 s", at=5.0, pace=0.8, around=5.0))
    assert east(found["v0"], 6.0) == pytest.approx(east(found["v2"], 5.0) - 4.6, abs=0.01)
    assert found["v0"].at(5.5).speed == pytest.approx(8.0, abs=0.1)


def test_all_others_ride_as_recorded_and_in_their_order(scene):
    _, plain = read_files(load_job(scene), begin=4.0, end=6.0)
    job = load_job(scene, {"traffic": ride(behind="v2", gap="2 s", at=5.0, moves="self")})
    _, other = read_files(job, begin=4.0, end=6.0)
    assert [t.key for t in other.traffic.traces] == [t.key for t in plain.traffic.traces]
    for a, b in zip(plain.traffic.traces, other.traffic.traces, strict=True):
        same = all(np.array_equal(getattr(a, n), getattr(b, n)) for n in ("times", "positions"))
        assert same == (a.id != "v0")
        names = [
            [log.lane_names[k] for k in t.lanes]
            for t, log in ((a, plain.traffic), (b, other.traffic))
        ]
        assert names[0][: len(names[1])] == names[1][: len(names[0])]


def test_a_ride_may_come_into_the_window_by_its_delay(tmp_path):
    scene = write_scenario(tmp_path)
    early = fcd_xml(vehicles=2, end=29.0, speed=0.0)
    late = fcd_xml(vehicles=1, begin=30.0, end=70.0, speed=1.0)
    steps = early.replace("</fcd-export>", "") + late.replace("<fcd-export>", "")
    steps = steps.replace('"v0" x="-40.000" y="-4.800"', '"w" x="30" y="-4.8"', 30)
    (tmp_path / "fcd.xml").write_text(steps, encoding="utf-8")
    assert "v0" not in asked(scene)
    found = asked(scene, **ride(delay="-28 s"))
    assert east(found["v0"], 5.0) == pytest.approx(-37.0, abs=0.01)


def test_nobody_rides_through_anybody(scene):
    with pytest.raises(ConfigError, match=r"rides\.v0: v0 would drive through v2 at 4\.0 s"):
        asked(scene, **ride(delay="-1.9 s"))
    # It may where nobody sees it, and if the other is left out.
    asked(scene, **ride(delay="-1.9 s"), leave_out=["v2"])


FAST = {"behind": "v2", "gap": 0.3, "at": 4.2, "moves": "self", "pace": 1.5, "around": 5.0}


@pytest.mark.parametrize(
    ("rides", "way_out"),
    [
        ({"v0": FAST}, "choose a larger gap, or another pace"),
        ({"v0": {"delay": "-1.9 s"}}, "choose another delay, gap or pace, or leave v2 out"),
        (
            {"v0": {"delay": "-1.5 s"}, "v2": {"behind": "v4", "gap": 1.9, "at": 5.0}},
            "choose another delay, gap or pace",
        ),
        (
            {"v4": {"behind": "v2", "gap": 1.0, "at": 5.0}, "v0": {"delay": "-2.1 s"}},
            "choose another delay, gap or pace",
        ),
    ],
)
def test_nobody_of_a_changed_pair_is_to_be_left_out(scene, rides, way_out):
    """Without it there would be no gap to show."""
    with pytest.raises(ConfigError, match="would drive through") as found:
        asked(scene, rides=rides)
    assert str(found.value).endswith(way_out)


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        ({"behind": "v9", "gap": 1, "at": 5}, "nobody near 5 s is called 'v9'"),
        ({"behind": "v2", "gap": 1, "at": 25, "moves": "self"}, "v2 is not on the road at 25 s"),
        ({"behind": "v2", "gap": 1, "at": 25}, "v0 is not on the road at 26 s"),
        (
            {"behind": "v1", "gap": 1, "at": 5, "moves": "self"},
            "v0 does not come by where the rear of v1 is at 5 s",
        ),
        ({"behind": "v1", "gap": 1, "at": 5}, "rear of v1 does not come by where v0 is at 6 s"),
        ({"delay": 1, "moves": "behind"}, "it needs behind, gap and at"),
        ({"behind": "v2", "gap": 1}, "a gap needs behind, gap and at"),
        ({"delay": 1, "behind": "v2", "gap": 1, "at": 5}, "either delay or gap"),
        ({"pace": 1.5}, "a pace needs around"),
        ({}, "give delay, gap or pace"),
        ({"delay": "3 km"}, "one of the units s, ms, min"),
    ],
)
def test_what_cannot_be_is_refused_in_words(scene, edit, said):
    with pytest.raises(ConfigError, match=said):
        asked(scene, **ride(**edit))


def test_a_name_that_nobody_has_changes_nothing_and_is_told(scene, caplog):
    with caplog.at_level(logging.WARNING):
        found = asked(scene, rides={"x": {"delay": 1}})
    assert "nobody near this time is called 'x'" in caplog.text
    assert east(found["v0"], 5.0) == pytest.approx(10.0, abs=0.01)


def test_what_was_done_is_told(scene, caplog):
    with caplog.at_level(logging.WARNING):
        asked(scene, **ride(behind="v2", gap="0.8 s", at=5.0, moves="self"))
        asked(scene, **ride(behind="v2", gap="0.8 s", at=5.0))
    assert "v0 rides 0.54 s earlier, 0.80 s behind v2 at 5 s (1.34 s in the log)" in caplog.text
    assert (
        "v2 rides 0.54 s later, so that v0 keeps its drive and is 0.80 s behind v2 at 5 s (1.34 s"
        " in the log)" in caplog.text
    )


def test_fewer_vehicles_are_some_of_more(tmp_path):
    scene = write_scenario(tmp_path, vehicles=60, persons=3, spacing=6.0)
    kept = [set(asked(scene, share=share)) for share in (0.0, 0.3, 0.7, 1.0)]
    assert all(few <= many for few, many in pairwise(kept))
    # The one that a camera rides with stays, and so do people.
    assert kept[0] == {"v0", "p0", "p1", "p2"} and len(kept[3]) == 63
    assert 10 < len(kept[1]) < 32 < len(kept[2]) < 54


def test_some_are_left_out_by_pattern(scene, caplog):
    assert set(asked(scene, leave_out=["v1", "vehicle:v4*"])) == {"v0", "v2", "v3", "v5"}
    assert "leave_out" not in caplog.text
    asked(scene, leave_out=["v1", "nobody*"])
    assert "traffic.leave_out: nobody near this time is called 'nobody*'" in caplog.text


STUDY = """scene: scene.yaml
clip: {camera: driver, from: 4, to: 5}
factors:
  gap:
    levels:
      short: {traffic: {rides: {v0: {behind: "a@b:2.c", gap: 1 s, at: 5}}}}
      long: {traffic: {rides: {v0: {behind: "a@b:2.c", gap: 2 s, at: 5, moves: MOVES}}}}
      none: {}
"""


@pytest.mark.parametrize(
    ("moves", "acts"),
    [("auto", {"vehicle:a@b:2.c"}), ("self", {"vehicle:v0", "vehicle:a@b:2.c"})],
)
def test_a_gap_factor_acts_on_the_one_that_it_moves(scene, moves, acts):
    """Whose id may hold dots and colons, and is whole in what is said."""
    log = scene.with_name("fcd.xml")
    log.write_text(log.read_text("utf-8").replace('"v2"', '"a@b:2.c"'), "utf-8")
    study = scene.with_name("study.yaml")
    study.write_text(STUDY.replace("MOVES", moves), encoding="utf-8")
    plan = plan_study(load_study(study))
    found = [subject_of_pair(plan.file, pair, rider="v0") for pair in plan.pairs]
    things = {each for subject in found for each in subject.acts.things}
    assert {each for each in things if each.startswith("vehicle")} == acts
    assert not any(subject.confounds for subject in found)
    said = plan_in_words(plan, ())
    assert ("whose ride it changes" in said) == (moves == "self")
    assert "traffic.rides.v0.behind" in said


def test_a_dry_run_says_keys_of_ids_with_colons_whole(scene):
    study = scene.with_name("study.yaml")
    text = STUDY.replace('v0: {behind: "a@b:2.c"', '"x:1": {behind: v0').replace("MOVES", "self")
    study.write_text(text, encoding="utf-8")
    assert "traffic.rides.x:1.gap" in plan_in_words(plan_study(load_study(study)), ())


def test_an_observer_that_nobody_is_is_refused_before_films_are_rendered(scene):
    study = scene.with_name("study.yaml")
    text = STUDY.replace("a@b:2.c", "v2").replace("MOVES", "auto")
    text += "report: {observers: {cyclist: {road_user: v77}}}\n"
    study.write_text(text, encoding="utf-8")
    plan = plan_study(load_study(study))
    said = r"study\.yaml:\d+:\d+: report\.observers\.cyclist\.road_user: no vehicle or person is"
    with pytest.raises(ConfigError, match=said):
        check_study(plan, StudyOrder(scene.with_name("out")))


def test_frames_are_other_ones_where_another_camera_makes_another_ride_move(scene):
    """The camera that looks is the same, and `--resume` would have kept the frames."""
    keys = set()
    for rider in ("v0", "v4"):
        changes = {"traffic": ride(behind="v2", gap=2, at=5), "cameras.driver.vehicle": rider}
        job = load_job(scene, {**changes, "traffic.leave_out": ["v1", "v3", "v5"]})
        keys.add(prepare(job, Request(camera="post"), np.array([5.0])).key)
    assert len(keys) == 2
