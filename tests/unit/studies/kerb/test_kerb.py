"""Pairs that pass a kerb, in closed form, and the study that is proposed of one."""

import json

import numpy as np
import pytest
from builders import TYPES, write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.kerb.vehicles import at_kerb
from sumo3dviz_pt.studies.offers import offer_lines, offer_notes, offers_of
from sumo3dviz_pt.studies.plan import plan_study

START, SPEED, LENGTH = -58.0, 6.0, 4.6
KERB = "30,-8.5"
"""Two metres beside the road, whose right edge lies at y = -6.4."""

NEEDED = (30.0 - START) / SPEED
"""Time from where rides begin to the kerb [s]."""

RIDES = {"a": (0.0, 0, ""), "b": (5.0, 0, ""), "beside": (2.0, 1, ""), "slow": (24.0, 0, "brakes")}
"""When rides begin [s], on which lane, and whether they brake 9 m before the kerb."""


def place_at(age, kind):
    """x [m] and speed [m/s] so long after a ride began; who brakes does at 2 m/s2, to 2 m/s."""
    brakes_at, lasts = (21.0 - START) / SPEED, 2.0
    late = age - brakes_at
    if not kind or late <= 0.0:
        return START + SPEED * age, SPEED
    slowing = min(late, lasts)
    x = 21.0 + SPEED * slowing - slowing**2 + (SPEED - 2.0 * lasts) * max(late - lasts, 0.0)
    return x, SPEED - 2.0 * slowing


def row_of(name, ride, time):
    """A ride's row of the log at a time; it drives to the west where it is `back`."""
    begin, lane, kind = ride
    x, speed = place_at(time - begin, kind == "brakes")
    if time < begin or x > 58.0:
        return ""
    x, angle = (-x, 270) if kind == "back" else (x, 90)
    edge = "w" if x < 0.0 else "e"
    return (
        f'<vehicle id="{name}" x="{x:.3f}" y="{-4.8 + 3.2 * lane:.2f}" angle="{angle}"'
        f' type="car" speed="{speed:.2f}" lane="{edge}_{lane}"/>'
    )


def log_of(rides):
    steps = []
    for time in np.arange(0.0, 46.0, 1.0):
        rows = [row_of(name, ride, time) for name, ride in rides.items()]
        steps.append(f'<timestep time="{time:.2f}">{"".join(rows)}</timestep>')
    return "<fcd-export>\n" + "\n".join(steps) + "\n</fcd-export>"


def scene_of(folder, rides):
    path = write_scenario(folder)
    (folder / "fcd.xml").write_text(log_of(rides), "utf-8")
    (folder / "types.add.xml").write_text(TYPES, "utf-8")
    return path


@pytest.fixture
def scene(tmp_path):
    return scene_of(tmp_path, RIDES)


def test_pairs_have_times_gaps_and_what_is_against_them(scene):
    found = at_kerb(load_job(scene), KERB)
    assert found.kerb.position.tolist() == [30.0, -8.5] and found.kerb.words == ""
    arrivals = {each.id: each.arrives for each in found.passages}
    assert arrivals["a"] == pytest.approx(NEEDED, abs=0.02)
    pairs = {(pair.first.id, pair.then.id): pair for pair in found.pairs}
    assert set(pairs) == {("a", "b"), ("b", "slow")}
    good, braking = pairs["a", "b"], pairs["b", "slow"]
    assert good.gap == pytest.approx(5.0 - LENGTH / SPEED, abs=0.03)
    assert [each.id for each in good.between] == ["beside"] and good.is_proposed
    assert good.first.lane == "e_0" and good.first.side == "left"
    assert braking.braking[1].startswith("brakes at") and not braking.is_proposed
    assert found.pairs[0] is good


def test_the_proposed_study_offers_the_gaps_that_it_names(scene, tmp_path, capsys):
    study = tmp_path / "study.yaml"
    assert main(["vehicles", str(scene), "--kerb", KERB, "-o", str(study)]) == 0
    assert "a " in capsys.readouterr().out
    study.write_text(study.read_text("utf-8") + "seed: 3\n", "utf-8")  # shuffles the design
    offers = offers_of(plan_study(load_study(study)))
    asked = {"short": 3.0, "medium": 5.0, "long": 7.0}
    assert list(offers) == list(asked)
    for name, gap in asked.items():
        first, then = offers[name].rows
        assert (first["road_user"], then["road_user"]) == ("vehicle:a", "vehicle:b")
        assert then["gap_before"] == pytest.approx(gap, abs=0.02)
        assert then["in_picture"] == pytest.approx(then["arrives_in_film"], abs=0.1)
    assert "beside" in study.read_text("utf-8")
    assert main(["study", str(study), "-o", str(tmp_path / "out"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "vehicles that arrive at the film's camera, by the film's time" in said
    assert "  film    vehicle  from  arrives  leaves" in said
    # Where others wait, too, each row says who.
    walker = "report: {observers: {walker: {position: [30, -8.5]}}}\n"
    study.write_text(study.read_text("utf-8") + walker, "utf-8")
    lines = offer_lines(offers_of(plan_study(load_study(study))))
    assert lines[0].startswith("vehicles that arrive, by") and lines[1].split()[:2] == [
        "film",
        "at",
    ]
    where = {line[10:28].rstrip() for line in lines[2:-1]}
    assert where == {"the film's camera", "walker"}


@pytest.mark.parametrize(
    ("rides", "options", "words"),
    [
        ({"a": (2.0, 0, "")}, (), ("1 vehicle comes by", "choose a busier place")),
        (
            {"a": (2.0, 0, "brakes"), "b": (7.0, 0, "brakes")},
            (),
            ("of 1 pair, in 1 they brake near the kerb;", "farther from junctions, or"),
        ),
        (
            {"a": (2.0, 0, ""), "b": (7.0, 0, "")},
            ("--kerb=-30,-8.5",),
            ("of 1 pair, in 1 they appear in sight", "farther from where rides begin, or"),
        ),
    ],
)
def test_why_no_pair_is_proposed(tmp_path, capsys, rides, options, words):
    study = tmp_path / "study.yaml"
    asked = ["vehicles", str(scene_of(tmp_path, rides)), "--kerb", KERB, *options]
    assert main([*asked, "-o", str(study)]) == 2 and not study.exists()
    said = capsys.readouterr()
    assert all(each in said.out for each in words), said.out
    assert "study.yaml is not written" in said.err


@pytest.mark.parametrize("more", [(), ("--to", "24")])
def test_nobody_but_the_pair_passes_within_the_proposed_films(tmp_path, more):
    """On whichever lane, from behind people, too, and whatever stretch pairs were looked for in."""
    rides = {
        "a": (2.0, 0, ""),
        "b": (7.0, 0, ""),
        "before": (0.4, 1, ""),
        "after": (11.0, 1, ""),
        "behind": (15.0, 1, "back"),
        "late": (24.0, 0, ""),
    }
    study = tmp_path / "study.yaml"
    scene = scene_of(tmp_path, rides)
    assert main(["vehicles", str(scene), "--kerb", KERB, *more, "-o", str(study)]) == 0
    said = study.read_text("utf-8")
    assert said.startswith("# a, then b")
    for name, offer in offers_of(plan_study(load_study(study))).items():
        assert [row["road_user"] for row in offer.rows] == ["vehicle:a", "vehicle:b"], name
    assert "after" in said and "behind" in said and "late" not in said


def test_what_people_would_wonder_at_is_noted(scene, tmp_path):
    """Who comes from behind the camera, who appears in sight, who brakes for somebody left out."""
    rides = {"a": (0.0, 0, ""), "ahead": (24.0, 0, "brakes"), "slow": (26.0, 0, "brakes")}
    path = scene_of(tmp_path, rides)
    study = tmp_path / "s.yaml"
    study.write_text(
        f"""scene: {path.name}
clip: {{camera: kerb, from: 24, to: 45}}
common:
  cameras.kerb:
    {{mode: eulerian, position: [30, -8.5, 1.6], look_at: [IN, -4.8, 1.2], lens: {{fov: 60}}}}
  traffic.leave_out: [ahead]
factors:
  gap:
    levels:
      one: {{traffic: {{rides: {{slow: {{delay: 1 s}}}}}}}}
      two: {{traffic: {{rides: {{slow: {{delay: 2 s}}}}}}}}
""",
        "utf-8",
    )
    text = study.read_text("utf-8")
    for side, words in (("60", "from outside of the picture"), ("20", "appears in sight")):
        study.write_text(text.replace("IN", side), "utf-8")
        notes = "\n".join(offer_notes(offers_of(plan_study(load_study(study)))))
        assert words in notes
        assert "slow brakes near the kerb for ahead, which is left out" in notes


@pytest.mark.parametrize(
    ("place", "position"),
    [
        ("30,-5", [30.0, -6.9]),
        ("30,-30,40", [30.0, -6.9]),
        ("e_0", [101.0, -6.9]),
        ("30,-7.5", [30.0, -7.5]),
    ],
)
def test_places_on_the_road_are_moved_to_its_edge(scene, place, position):
    kerb = at_kerb(load_job(scene), place).kerb
    assert kerb.position == pytest.approx(np.array(position), abs=0.01)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--kerb", KERB, "--type", "car"), "--type: goes with a list, not with --kerb"),
        (("--kerb", KERB, "--near", "1,2"), "--near: goes with a list, not with --kerb"),
        (("--kerb", KERB, "--follow", "a"), "--kerb: goes with --kerb, not with --follow"),
        (("--pick", "1"), "--pick: goes with --kerb, not with a list"),
        (("--follow", "a", "--sort", "id"), "--sort: goes with a list, not with --follow"),
        (("--kerb", KERB, "--pick", "9"), "pick: there are 2 pairs; give 1 to 2"),
        (("--kerb", "pots"), "did you mean 'post'?"),
        (("--kerb", "900,900"), "no lane for cars is near"),
        (("--kerb", KERB, "-o", "a.csv"), "must end in .yaml"),
    ],
)
def test_what_cannot_be_asked(scene, capsys, options, said):
    assert main(["vehicles", str(scene), *options]) == 2
    assert said in capsys.readouterr().err


def test_as_json(scene, capsys):
    assert main(["vehicles", str(scene), "--kerb", KERB, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [pair["no"] for pair in found["pairs"]] == [1, 2]
    assert found["study"].startswith("# a, then b")
