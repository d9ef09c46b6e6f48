"""Pairs of any design, what confounds them, and what is known of them without pixels."""

from collections import Counter

import pytest
from builders import write_scenario

from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.foresight import foresight, subject_of_pair
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.run import plan_in_words
from sumo3dviz_pt.studies.stimuli import possible_pairs

RED = 'vehicles: {by_id: {v0: {colour: "#b01010"}}}'
WHITE = '{vehicles: {by_id: {v0: {colour: "#f4f4f2"}}}}'
THREE = {
    "light": "a: {sky: {preset: sky_blue}}, b: {sky: {preset: sky_overcast}}, c: {lights: 'on'}",
    "ahead": f"a: {{}}, b: {{{RED}}}, c: {WHITE}",
    "street": "a: {}, b: {roads.colour: '#703030'}, c: {roads.colour: '#307030'}",
    "plants": "a: {}, b: {ground: {planting: none}}, c: {objects.trees.scale: 2}",
}


def planned(folder, factors, design="", more=""):
    write_scenario(folder, vehicles=2)
    body = "".join(f"  {name}: {{{more}levels: {{{own}}}}}\n" for name, own in factors.items())
    text = f"scene: scene.yaml\nclip: {{camera: post, from: 2, to: 2.2}}\nfactors:\n{body}{design}"
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    return plan_study(load_study(folder / "study.yaml"))


def tied(plan) -> bool:
    """Whether films are tied together by pairs that are compared."""
    groups = {each.name: {each.name} for each in plan.stimuli}
    for pair in plan.pairs:
        both = groups[pair.one] | groups[pair.other]
        groups |= dict.fromkeys(both, both)
    return len({frozenset(group) for group in groups.values()}) == 1


@pytest.mark.parametrize(
    ("design", "factors", "films"), [("fraction", 4, 9), ("latin", 3, 9)], ids=["3^4", "latin"]
)
def test_films_of_designs_without_neighbours_are_tied_and_every_factor_judged_twice(
    tmp_path, design, factors, films
):
    """In a fraction 3^4 in 9 any two films differ in three factors."""
    chosen = dict(list(THREE.items())[:factors])
    plan = planned(tmp_path, chosen, f"design: {design}\n")
    assert len(plan.stimuli) == films and tied(plan)
    assert len(plan.pairs) == 8 and possible_pairs(plan.stimuli) == 36
    times = Counter(factor for pair in plan.pairs for factor in pair.factors)
    assert set(times) == set(chosen) and min(times.values()) >= 2
    said = plan_in_words(plan, plan.stimuli)
    assert "pairs that are compared, 8 of 36" in said
    assert all(f"{name} is confounded with what two factors do together" in said for name in chosen)


def test_a_pair_of_several_factors_is_about_all_of_them_and_nothing_else(tmp_path):
    plan = planned(tmp_path, THREE, "design: fraction\n")
    for pair in plan.pairs:
        subject = subject_of_pair(plan.file, pair)
        assert not subject.confounds and not subject.acts.anything
        assert subject.acts.light == ("light" in pair.factors)
        assert subject.acts.may_look("vehicle:v0") == ("ahead" in pair.factors)
        assert subject.acts.may_reshape("tree:3") == ("plants" in pair.factors)
        assert not subject.acts.may_look("vehicle:v1")


def test_full_designs_keep_all_pairs_of_one_factor_and_no_others(tmp_path):
    plan = planned(tmp_path, {name: THREE[name] for name in ("light", "plants")})
    assert len(plan.pairs) == 18 and all(len(pair.factors) == 1 for pair in plan.pairs)


def test_factors_that_always_go_together_are_named_before_rendering(tmp_path):
    factors = {"light": THREE["light"], "ahead": f"a: {{}}, b: {{{RED}}}"}
    exclude = "exclude: [{light: a, ahead: b}, {light: [b, c], ahead: a}]\n"
    plan = planned(tmp_path, factors, exclude)
    assert any("light and ahead cannot be told apart" in note for note in plan.notes)
    table = tmp_path / "t.csv"
    table.write_text("light,ahead\na,a\nb,b\nc,b\n", encoding="utf-8")
    plan = planned(tmp_path, factors, "design: {table: t.csv}\n")
    assert any("light and ahead cannot be told apart" in note for note in plan.notes)
    assert tied(plan)


BESIDE = {
    "seed": "seed: 8",
    "quality": "quality: reference",
    "output.exposure": "output.exposure: -0.5",
    "cameras.post.position": "cameras.post.position: [1, 2, 3]",
    "traffic.leave_out": "traffic: {leave_out: [v1]}",
}


@pytest.mark.parametrize("key", BESIDE)
@pytest.mark.parametrize("asked", ["", "acts_on: {looks: ['vehicle:v0']}, "], ids=["ruled", "said"])
def test_what_a_level_sets_beside_its_factor_is_a_confound(tmp_path, key, asked):
    levels = f"white: {WHITE}, red: {{{RED}, {BESIDE[key]}}}"
    plan = planned(tmp_path, {"ahead": levels}, more=asked)
    (pair,) = plan.pairs
    subject = subject_of_pair(plan.file, pair)
    assert [change.partition(": ")[0] for change in subject.confounds] == [key]
    assert not subject.acts.anything and not subject.acts.moves and not subject.acts.develops
    assert subject.acts.may_look("vehicle:v0") and not subject.acts.may_reshape("vehicle:v1")
    (said,) = foresight(plan)
    assert said.startswith(f"ahead: levels also set {key}, beside what the factor is about")


FORESEEN = [
    ("{vehicles: {by_id: {ghost: {colour: '#ffffff'}}}}", "nobody in the log is called ghost"),
    ("{vehicles: {by_id: {v0: {colour: '#f4f4f3'}}}}", "nobody tells them apart"),
    ("{scenario.additional: [types.add.xml]}", "no rule knows scenario.additional"),
    ("{seed: 9}", "no rule knows seed, so it may change anything, and nothing can be proven"),
    (f"{{{RED}}}", None),
]


@pytest.mark.parametrize(("level", "said"), FORESEEN, ids=[str(said) for _, said in FORESEEN])
def test_what_is_known_without_pixels_is_said(tmp_path, level, said):
    other = WHITE if "by_id" in level else "{}"
    other = other.replace("v0", "ghost") if "ghost" in level else other
    found = foresight(
        planned(tmp_path, {"what": f"a: {other.replace('#f4f4f2', '#f4f4f4')}, b: {level}"})
    )
    assert [said in each for each in found] == ([True] if said else [])


def test_another_log_is_not_taken_for_a_gap(tmp_path):
    """It was called to differ in its factor alone, whatever else moved otherwise."""
    write_scenario(tmp_path, vehicles=2)
    (tmp_path / "other.xml").write_bytes((tmp_path / "fcd.xml").read_bytes() + b"\n")
    levels = "short: {}, long: {scenario: {trajectories: other.xml}}"
    (said,) = foresight(planned(tmp_path, {"gap": levels}))
    assert said.startswith("gap: levels set another traffic log, so everything that moves may")


def test_a_gap_of_the_ridden_vehicle_moves_the_camera(tmp_path):
    ride = "common: {cameras.ride: {mode: lagrangian, vehicle: v0, view: driver}}\n"
    levels = "a: {}, b: {traffic: {rides: {v0: {delay: 0.2 s}}}}"
    plan = planned(tmp_path, {"gap": levels}, ride.replace("ride:", "post:"))
    (said,) = foresight(plan)
    assert said.startswith("gap: the camera rides in v0")
