"""`check --stress`: which cases a scene has, and how their pictures are judged."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from builders import box, cube, frame_of, mover, view_at, write_scenario

from sumo3dviz_pt.errors import ConfigError, interrupted
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.scene import LampSet
from sumo3dviz_pt.pipeline.production import Request, prepare, read
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.report.stress.cases import (
    MOMENTS,
    SIZE,
    SPOTS,
    Case,
    all_cases,
    facts_of,
    nearest_body,
    why_not,
)
from sumo3dviz_pt.report.stress.checks import (
    DARKEST,
    MARGIN,
    CaseEvidence,
    CaseLight,
    judge,
    light_of,
)
from sumo3dviz_pt.report.stress.stress import CaseOutcome, StressReport, chosen, in_words

TIME = 4.5


def facts_in(folder, **traffic):
    """What a small scene has to offer."""
    job = load_job(write_scenario(folder, **traffic))
    _, scenario, trajectories = read(job)
    made = prepare(job, Request("post", "draft", SIZE), np.array([TIME]))
    return facts_of(made, scenario, trajectories, time=TIME)


def case_of(name):
    return next(case for case in all_cases() if case.name == name)


# Cases --------------------------------------------------------------------------------------


def test_cases_have_names_of_their_own_and_known_places():
    cases = all_cases()
    assert len({case.name for case in cases}) == len(cases)
    assert {case.spot for case in cases} == {"shot", *SPOTS}, "every spot is used"
    assert {case.moment for case in cases} == set(MOMENTS)


def test_cases_cover_what_was_promised():
    cases = all_cases()
    suns = {case.elevation for case in cases} - {None}
    assert suns == set(range(-18, 91, 3)) and 0 in suns
    stops = {case.exposure for case in cases}
    assert max(stops) - min(stops) == 20
    assert {(1, 1), (8, 8), (3840, 2160)} <= {case.size for case in cases}
    assert {1, 4096} <= {case.spp for case in cases} and {5.0, 150.0} <= {c.fov for c in cases}
    assert sum(case.twice for case in cases) >= 3 and any(case.film for case in cases)


@pytest.mark.parametrize(
    ("traffic", "missing"),
    [
        ({"vehicles": 4}, {"nobody on the road"}),
        (
            {"vehicles": 0},
            {"camera inside a body", "camera 5 cm from paint", "most road users"},
        ),
    ],
)
def test_what_a_scene_cannot_have_is_left_out_with_a_reason(tmp_path, traffic, missing):
    facts = replace(facts_in(tmp_path, **traffic), memory=1e6)
    reasons = {case.name: why_not(case, facts) for case in all_cases()}
    assert {name for name, why in reasons.items() if why} == missing
    assert all("on the road" in reasons[name] for name in missing)


@pytest.mark.parametrize(("memory", "words"), [(0, "does not say"), (4000, "of 4000 MB")])
def test_a_large_picture_needs_memory(tmp_path, memory, words):
    facts = replace(facts_in(tmp_path, vehicles=1), memory=memory)
    large = [case for case in all_cases() if why_not(case, facts) and case.size[0] > 64]
    assert [case.size for case in large] == [(3840, 2160)]
    assert words in (why_not(large[0], facts) or "")


def test_a_sky_of_the_users_own_has_no_sun_to_move(tmp_path):
    facts = replace(facts_in(tmp_path, vehicles=1), sun=None)
    for case in all_cases():
        if case.elevation is not None:
            assert "light of its own" in (why_not(case, facts) or "")


def test_cameras_stand_where_the_cases_say(tmp_path):
    facts = facts_in(tmp_path, vehicles=4)

    def stand(name):
        case = case_of(name)
        camera = SPOTS[case.spot](facts, case)
        return np.array(camera.position), camera

    place, camera = stand("camera inside a body")
    assert np.allclose(place, facts.body.middle) and 0.2 < place[2] < 1.5
    place, camera = stand("camera 5 cm from paint")
    assert np.isclose(np.linalg.norm(place - facts.body.paint), 0.05)
    assert abs(camera.heading) == pytest.approx(180), "cars go east, their left looks north"
    assert stand("camera 2 km high looking down")[1].pitch == -90
    assert stand("camera looks at the zenith")[1].pitch == 90
    place, camera = stand("camera under the road")
    assert place[2] == pytest.approx(-1) and -4.9 < place[1] < -1.5
    place, camera = stand("road at a grazing angle from 2 km")
    assert place[2] == pytest.approx(60) and -2.0 < camera.pitch < -1.0
    assert np.linalg.norm(place - facts.road) == pytest.approx(2000.9, abs=0.1)
    place, camera = stand("camera looks at nothing")
    assert place[0] > 200 and camera.heading == pytest.approx(90) and camera.pitch == 0
    assert stand("field of view 150 deg")[1].lens.fov == 150
    sun = stand("sun disc in the picture at 30 deg")[1]
    azimuth = np.degrees(np.arctan2(facts.sun[0], facts.sun[1]))
    assert sun.pitch == pytest.approx(30) and np.isclose(
        np.cos(np.radians(sun.heading - azimuth)), 1
    )


def test_moments_are_those_of_the_log(tmp_path):
    times = facts_in(tmp_path, vehicles=4).times
    assert times["shot"] == TIME and times["first"] == 0.0 and times["last"] == 12.0
    assert 0 <= times["crowded"] <= 12 and "empty" not in times
    assert "crowded" not in facts_in(tmp_path, vehicles=0).times


def test_the_nearest_vehicle_goes_before_a_nearer_walker():
    far = mover("vehicle:a", [10.0, 0.0, 0.0], (0.5,) * 3)
    near = mover("person:p", [1.0, 0.0, 0.0], (0.5,) * 3)
    bodies = {"cube": cube()}
    assert nearest_body([near, far], bodies, np.zeros(3)).id == "vehicle:a"
    assert nearest_body([near], bodies, np.zeros(3)).id == "person:p"
    assert nearest_body([], bodies, np.zeros(3)) is None


def test_paint_lies_on_the_left_side_of_a_turned_and_scaled_body():
    placed = Transform.from_pose([5.0, 0.0, 0.0], yaw=np.pi / 2, scale=[1.0, 2.0, 1.0])
    user = replace(mover("vehicle:a", [0.0, 0.0, 0.0], (0.5,) * 3), world_from_body=placed)
    body = nearest_body([user], {"cube": cube(side=2.0)}, np.zeros(3))
    assert np.allclose(body.middle, [5.0, -1.0, 1.0]) and np.allclose(body.outward, [-1.0, 0, 0])
    assert np.isclose(body.paint[0], 5.0 - 2.0), "half of 2 m x scale 2, to the west"


def test_only_chosen_cases_run():
    assert {case.elevation for case in chosen(["sun at*"])} == set(range(-18, 91, 3))
    assert [case.name for case in chosen(["camera looks at nothing"])] == [
        "camera looks at nothing"
    ]
    assert chosen([]) == all_cases()
    with pytest.raises(ConfigError, match="did you mean 'camera under the road'"):
        chosen(["camera under the raod"])


# Judging ------------------------------------------------------------------------------------

LIGHT = CaseLight(brightest=5e4, common=0.5, directed=2.0, mean=0.3, sky=(0.09, 2.0), sun=4e4)


def evidence(radiance=0.1, *, sky=0.0, light=LIGHT, **changes):
    """A sound picture of 36x64: surfaces of some radiance with a little structure."""
    picture = np.full((36, 64, 3), radiance, np.float32)
    picture[::2] *= 1.01
    open_sky = np.zeros((36, 64), bool)
    open_sky[: round(36 * sky)] = True
    return replace(CaseEvidence(picture, open_sky, light, 30.0, 0.5, "neutral"), **changes)


def spoilt(value, *, pixels=1):
    """The same with some pixels of a value."""
    seen = evidence()
    picture = seen.radiance.copy()
    picture.reshape(-1, 3)[:pixels] = value
    return replace(seen, radiance=picture)


PLAIN = Case("plain")


def test_a_sound_picture_passes():
    again = evidence().radiance.copy()
    assert judge(PLAIN, evidence(again=again, stored=again)) == ()


@pytest.mark.parametrize(
    ("seen", "words"),
    [
        (spoilt(np.nan), "1 of 2304 pixels of the picture are NaN or Inf"),
        (spoilt(np.inf, pixels=3), "3 of 2304 pixels of the picture are NaN or Inf"),
        (spoilt([0.1, -1e-6, 0.1], pixels=2), "2 of 2304 pixels of the picture are negative"),
        (spoilt(6e4), "brighter than any light or the cap"),
        (evidence(1.3), "a white wall would"),
        (evidence(0.0), "the picture is black"),
        (evidence(DARKEST * LIGHT.mean * 0.9), "the picture is black"),
        (evidence(again=np.zeros((36, 64, 3), np.float32)), "2304 of 2304 pixels differ"),
        (evidence(stored=np.full((36, 64, 3), np.inf, np.float32)), "stored picture are NaN"),
        (evidence(stored=np.full((36, 64, 3), 0.2, np.float32)), "of 255 codes"),
        (
            replace(evidence(), radiance=np.full((36, 64, 3), 0.1, np.float32)),
            "all pixels are the same",
        ),
    ],
)
def test_a_faulty_picture_is_found(seen, words):
    assert words in "; ".join(judge(PLAIN, seen))


def test_twice_the_energy_of_a_white_wall_is_found_and_less_is_not():
    wall = LIGHT.wall
    assert judge(PLAIN, evidence(0.98 * wall)) == ()
    assert judge(PLAIN, evidence(1.2 * MARGIN * wall)) != ()
    assert judge(PLAIN, evidence(1.2 * MARGIN * wall, sky=1.0)) == (), "the sky is no wall"


@pytest.mark.parametrize(
    ("radiance", "misty", "sound"), [(2.2, True, True), (2.2, False, False), (5.5, True, False)]
)
def test_lamps_light_the_air_before_the_open_sky_only_where_it_scatters(radiance, misty, sound):
    lit = replace(LIGHT, lamps=3.0, misty=misty)
    assert (judge(PLAIN, evidence(radiance, sky=1.0, light=lit)) == ()) == sound


@pytest.mark.parametrize(("radiance", "sound"), [(0.05, False), (0.1, True), (2.2, False)])
def test_open_sky_is_the_baked_sky(radiance, sound):
    problems = judge(PLAIN, evidence(radiance, sky=1.0))
    assert problems == () if sound else "the open sky shines at" in problems[0]


def test_a_few_glints_are_no_energy_from_nowhere():
    assert judge(PLAIN, spoilt(4e4, pixels=20)) == ()
    assert "white wall" in "; ".join(judge(PLAIN, spoilt(4e4, pixels=40)))


def test_darkness_is_allowed_where_no_light_need_come():
    assert judge(replace(PLAIN, may_be_dark=True), evidence(0.0)) == ()


def test_a_sun_that_should_be_seen_is_missed():
    looking = replace(PLAIN, shows_sun=True)
    assert "sun's disc" in "; ".join(judge(looking, evidence(sky=1.0)))
    assert judge(looking, replace(spoilt(4e4), open_sky=np.ones((36, 64), bool))) == ()
    cloudy = replace(LIGHT, sun=0.0)
    assert judge(looking, evidence(sky=1.0, light=cloudy)) == (), "hidden by clouds"


def test_one_pixel_is_never_blank():
    picture = np.full((1, 1, 3), 0.1, np.float32)
    seen = evidence(radiance=0.1)
    one = replace(seen, radiance=picture, open_sky=np.zeros((1, 1), bool))
    assert judge(PLAIN, one) == ()


# Light --------------------------------------------------------------------------------------


def test_light_of_an_even_sky():
    sky = SimpleNamespace(radiance=np.full((64, 128, 3), 0.5, np.float32), sun=None)
    light = light_of(sky, (), frame_of(view_at([0.0, 0.0, 1.0])))
    assert light.common == pytest.approx(0.5) and light.mean == pytest.approx(0.5)
    assert light.directed == pytest.approx(0, abs=1e-6) and light.brightest == 0.5
    assert light.sky == pytest.approx((0.5, 0.5))


def test_a_sun_painted_into_the_sky_counts_as_directed_light():
    """As much as a disc of the same irradiance."""
    radiance = np.full((512, 1024, 3), 0.1, np.float32)
    radiance[100, 200] = 1e4
    frame = frame_of(view_at([0.0, 0.0, 1.0]))
    painted = light_of(SimpleNamespace(radiance=radiance, sun=None), (), frame)
    solid = np.sin((100.5) / 512 * np.pi) * (np.pi / 512) * (2 * np.pi / 1024)
    assert painted.directed == pytest.approx(1e4 * solid, rel=0.01)
    assert painted.common == pytest.approx(0.1)


def test_lamps_and_the_suns_disc_are_lights():
    sun = SimpleNamespace(radiance=np.full(3, 900.0), irradiance=np.full(3, 2.0))
    sky = SimpleNamespace(radiance=np.full((64, 128, 3), 0.5, np.float32), sun=sun)
    lamps = {"a": np.array([[3.0, 1.0, 0.0], [0.0, 0.0, 0.0]]), "none": np.zeros((0, 3))}
    frame = frame_of(view_at([0.0, 0.0, 1.0]), lamps=lamps)

    def light(*, at_night):
        mesh = box((0, 0, 0), (1, 1, 1))
        sets = [LampSet(name, "x", mesh, np.zeros(12), (), at_night) for name in lamps]
        return light_of(sky, sets, frame)

    assert light(at_night=True).brightest == 900 and light(at_night=True).sun == pytest.approx(900)
    assert 1 < light(at_night=True).lamps < 3 and light(at_night=False).lamps == 0
    assert light(at_night=False).wall == pytest.approx(0.5 + 2 / np.pi, rel=1e-3)


def test_lamps_that_never_change_and_those_of_vehicles_are_lights():
    sky = SimpleNamespace(radiance=np.full((64, 128, 3), 1e-4, np.float32), sun=None)
    frame = frame_of(view_at([0.0, 0.0, 1.0]))
    street = LampSet(
        "street", "x", box((0, 0, 0), (1, 1, 1)), np.zeros(12), (), radiance=np.full((1, 3), 2.0)
    )
    head = SimpleNamespace(role="head", size=(0.1, 0.1))
    running = SimpleNamespace(intensity={"head": (0.1, 0.1, 0.1)}, sampled=True)
    scene = SimpleNamespace(running=running, prototypes={"car": SimpleNamespace(lamps=(head,))})
    assert light_of(sky, [street], frame).lamps == pytest.approx(2.0)
    lit = light_of(sky, [street], frame, scene)
    assert lit.brightest == pytest.approx(0.1 / (0.6495 * 0.01), rel=1e-3)
    assert lit.lamps == pytest.approx(lit.brightest)


def test_an_interrupt_behind_an_error_is_still_one():
    inner = RuntimeError("in a kernel")
    inner.__cause__ = KeyboardInterrupt()
    outer = ValueError("in a session")
    outer.__context__ = inner
    assert interrupted(outer) and interrupted(inner)
    assert not interrupted(ValueError("alone")) and not interrupted(None)


# Words --------------------------------------------------------------------------------------


def test_the_report_names_every_case():
    outcomes = (
        CaseOutcome("a", "ok", cpu=1.0),
        CaseOutcome(
            "b", "failed", "the picture is black", 2.0, nonfinite=3, negative=2, capped=0.3
        ),
        CaseOutcome("c", "left out", "nobody"),
    )
    report = StressReport("post", 4.5, outcomes)
    words = in_words(report)
    assert "the picture is black; 3 values were NaN or Inf; 2 values were negative" in words
    assert "the firefly cap took 30% of the energy" in words and "left out" in words
    assert "1 ok, 1 failed, 1 left out, 3 CPU-seconds" in words
    assert report.as_dict()["outcomes"][1]["verdict"] == "failed" and report.count("failed") == 1
