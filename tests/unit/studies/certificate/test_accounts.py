"""Accounts of two films: each kind of difference is named, unless the factor acts on it."""

import copy
import json

import numpy as np
import pytest
from builders import frame_of, mover, view_at, write_scenario

from sumo3dviz_pt.pipeline.accounts import RoadUsers
from sumo3dviz_pt.pipeline.provenance import with_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.studies.certificate.accounts import (
    account_faults,
    moving_otherwise,
    named_differences,
)
from sumo3dviz_pt.studies.certificate.acts import Acts, acts_of, subject_of

NOTHING = Acts()
PLANNED = ("vehicles.by_id.a.colour: #ffffff -> #c00000",)


def account():
    """A film of three frames with two cars."""
    camera = {
        "position": [0.0, 0.0, 1.2], "forward": [1.0, 0.0, 0.0], "up": [0.0, 0.0, 1.0], "fov": 60.0,
    }  # fmt: skip
    user = {"body": "sedan", "colour": [1, 1, 1], "frames": [0, 2], "motion": "m", "lamps": []}
    return {
        "fps": 25.0, "frame_rate": "25", "size": [96, 54], "exposure": 0.5, "tone": "neutral",
        "glare": 0.0, "world": "w", "light": "l", "plan": "p", "variant": "llvm",
        "scene": {"seed": 7}, "inputs": {"fcd.xml": "1"}, "versions": {"numpy": "2"},
        "signal_changes": [{"frame": 1, "time": 4.04, "tls": "C", "state": "Gr"}],
        "road_users": {"vehicle:a": dict(user), "vehicle:b": dict(user)},
        "frames": [
            {"frame": n, "time": 4.0 + n / 25, "camera": dict(camera), "placed": f"{n}",
             "drawn": ["vehicle:a", "vehicle:b"]}
            for n in range(3)
        ],
    }  # fmt: skip


def faults(change, acts=NOTHING, planned=PLANNED):
    other = copy.deepcopy(account())
    change(other)
    return account_faults(account(), other, acts, planned)


def test_equal_accounts_have_no_faults():
    assert not faults(lambda other: None)
    assert not named_differences(account(), account(), Acts(light=True))


def test_a_film_of_several_devices_is_told_even_where_both_are():
    mixed = account() | {"film": "a.mp4", "devices": ["cuda on NVIDIA H200, CUDA 12.4", "llvm"]}
    said = account_faults(mixed, copy.deepcopy(mixed), NOTHING, PLANNED)
    assert len(said) == 2 and "a.mp4 mixes frames of several devices" in said[0]


@pytest.mark.parametrize(
    ("acts", "told"), [(NOTHING, True), (Acts(light=True), True), (Acts(motion=True), False)]
)
def test_films_that_sound_otherwise_are_told_unless_traffic_may_differ(acts, told):
    def heard(name, level):
        return {"sound": {"file": f"{name}.wav", "levels": {"LAeq": {"listener": level}}}}

    one, loud = account() | heard("a", 60.0), account() | heard("b", 61.0)
    assert account_faults(one, account() | heard("b", 60.0), acts, PLANNED) == []
    said = account_faults(one, loud, acts, PLANNED)
    assert any("they sound otherwise" in each for each in said) == told


def frame_more(other):
    other["frames"].append(other["frames"][-1])


def another_time(other):
    other["frames"][2]["time"] += 0.04


def camera_moved(other):
    other["frames"][1]["camera"]["position"] = [0.0, 0.01, 1.2]


def another_lens(other):
    other["frames"][0]["camera"]["fov"] = 61.0


def missing(other):
    other["frames"][2]["drawn"] = ["vehicle:a"]


def another_body(other):
    other["road_users"]["vehicle:b"]["body"] = "coupe"


def another_colour(other):
    other["road_users"]["vehicle:b"]["colour"] = [1, 0, 0]


def elsewhere(other):
    other["road_users"]["vehicle:b"]["motion"] = "n"
    other["frames"][1]["placed"] = "x"


def braking(other):
    other["road_users"]["vehicle:b"]["lamps"] = [{"frame": 2, "lit": ["brake"]}]


def late(other):
    other["signal_changes"][0]["frame"] = 2


def brighter(other):
    other["exposure"] = 0.6


def another_tone(other):
    other["tone"] = "agx"


def another_seed(other):
    other["scene"]["seed"] = 8


def another_file(other):
    other["inputs"]["fcd.xml"] = "2"


def another_world(other):
    other["world"] = "v"


ALL = Acts(anything=True)
CASES = [
    (frame_more, "the films have 3 and 4 frames", None),
    (another_time, "frame 2 shows 4.08 s in one film and 4.12 s in the other", Acts(motion=True)),
    (camera_moved, "in 1 frame, in frame 1 by 1 cm and 0 deg", Acts(camera=True)),
    (another_lens, "with lenses of 60 and 61 deg", Acts(camera=True)),
    (missing, "from frame 2 on only one film shows vehicle:b", Acts(things=("vehicle:b",))),
    (another_body, "another body: vehicle:b", Acts(things=("vehicle:b",))),
    (another_colour, "another colour: vehicle:b", Acts(looks=("vehicle:b",))),
    (elsewhere, "from frame 1 on road users are elsewhere: vehicle:b", Acts(motion=True)),
    (braking, "lamps are lit otherwise: vehicle:b", Acts(light=True)),
    (late, "traffic light C goes to Gr at frame 1 in the first film only", Acts(motion=True)),
    (brighter, "exposure [EV] is 0.5 in one film and 0.6 in the other", Acts(picture=True)),
    (another_tone, "tone curve is neutral in one film and agx in the other", Acts(light=True)),
    (another_seed, "no level changes this: seed: 7 -> 8", None),
    (another_file, "no level changes this: input fcd.xml: other content", None),
    (another_world, "roads, houses, plants, lamps or their materials are others", ALL),
]


@pytest.mark.parametrize(
    ("change", "said", "acts"), CASES, ids=lambda each: getattr(each, "__name__", "")
)
def test_what_differs_is_named_unless_the_factor_acts_on_it(change, said, acts):
    found = faults(change)
    assert len(found) == 1 and said in found[0]
    if acts is not None:
        assert not faults(change, acts)


def test_what_stands_is_the_same_if_the_factor_acts_on_road_users_alone():
    assert faults(another_world, Acts(looks=("vehicle:a", "person:a")))
    assert not faults(another_world, Acts(things=("vehicle:a", "tree:*")))
    assert not faults(another_world, Acts(light=True))


def test_what_levels_set_may_differ():
    planned = ("seed: 7 -> 8", "scenario.trajectories: fcd.xml -> fcd.xml")
    assert not faults(another_seed, planned=planned)
    assert not faults(another_file, planned=planned)


@pytest.mark.parametrize(
    ("planned", "name", "may"),
    [
        # A mesh that is replaced under its name is no plan, whatever words a level holds.
        ("vehicles.by_id.car.7.colour: #ffffff -> #c00000", "models/car.obj", False),
        ("vehicles.by_id.a.model: null -> truck", "truck.obj", False),
        ("vehicles.by_id.a.model: x/truck.yaml -> y/truck.yaml", "y/truck.yaml", True),
        ("vehicles.by_id.a.model: x/truck.yaml -> y/truck.yaml", "y/mesh.obj", True),
        ("vehicles.by_id.a.model: x/truck.yaml -> y/truck.yaml", "z/mesh.obj", False),
        ("sky.preset: sky_blue -> sky_overcast", "scene_templates/sky/sky_overcast.yaml", True),
        ("sky.preset: sky_blue -> sky_overcast", "scene_templates/sky/sky_golden.yaml", False),
        ('scenario.additional: [] -> ["zebra.add.xml"]', "zebra.add.xml", True),
        ('scenario.additional: [] -> ["zebra.add.xml"]', "fcd.xml", False),
        ("scenario.sumocfg: a.sumocfg -> b.sumocfg", "fcd.xml", True),
        ("scenario.sumocfg: a.sumocfg -> b.sumocfg", "models/car.obj", False),
        ("roads.surface: null -> stones.png", "stones.png", True),
        ("roads.surface: null -> stones.png", "bricks.png", False),
    ],
)
def test_only_files_that_levels_name_may_have_other_content(planned, name, may):
    one, other = account(), account()
    one["inputs"][name], other["inputs"][name] = "1", "2"
    one["companions"] = other["companions"] = {"y/truck.yaml": ["y/mesh.obj"]}
    told = [each for each in account_faults(one, other, NOTHING, (planned,)) if name in each]
    assert bool(told) is not may


def test_exposure_belongs_to_the_level_of_light_and_is_named():
    other = account()
    brighter(other)
    assert named_differences(account(), other, Acts(light=True)) == ["exposure [EV]: 0.5 and 0.6"]


# What accounts say of road users ------------------------------------------------------------


def told(*frames):
    """What the account says after frames, each a list of movers."""
    users = RoadUsers()
    digests = [
        users.add(n, frame_of(view_at((0, 0, 1)), movers=movers)) for n, movers in enumerate(frames)
    ]
    return users.account(), digests


def test_the_account_tells_motion_by_digests():
    still, digests = told([mover("vehicle:a", (1, 2, 0), (1, 0, 0))] * 1, [
        mover("vehicle:a", (1, 2, 0), (1, 0, 0))])  # fmt: skip
    assert digests[0] == digests[1]
    user = still["vehicle:a"]
    assert (user["body"], user["colour"], user["frames"]) == ("cube", [1.0, 0.0, 0.0], [0, 1])
    moved, others = told(
        [mover("vehicle:a", (1, 2, 0), (1, 0, 0))], [mover("vehicle:a", (1, 2.001, 0), (1, 0, 0))]
    )
    assert others[0] == digests[0] and others[1] != digests[1]
    assert moved["vehicle:a"]["motion"] != user["motion"]


def test_last_bits_of_a_processor_do_not_count():
    near = np.nextafter(1.0, 2.0)
    assert (
        told([mover("vehicle:a", (1.0, 2, 0), (1, 0, 0))])
        == told([mover("vehicle:a", (near, 2, 0), (1, 0, 0))])
    )  # fmt: skip


def wide_open(other):
    for frame in other["frames"]:
        frame["camera"]["lens"] = {"aperture": 0.01, "focus": 12.0}


def blurred(other):
    other["shutter"] = {"open": 0.02, "rolling": 0.0}


def metered(other):
    other["metering"] = {"mode": "auto", "ev": 0.0, "metered": 0.5}


def recorded(other):
    other["response"] = "dashcam"


def grainy(other):
    other["optics"] = {"vignetting": 0.0, "grain": 0.3, "slope": 0.5, "eyes": [1, 1]}


@pytest.mark.parametrize(
    ("change", "words", "allowed"),
    [
        (wide_open, "lenses of a pinhole and aperture 0.01, focus 12", Acts(camera=True)),
        (
            blurred,
            "shutter is an instant in one film and open for 0.02 s in the other",
            Acts(camera=True),
        ),
        (metered, "metering is None in one film", Acts(picture=True)),
        (recorded, "camera's response is None in one film and dashcam", Acts(picture=True)),
        (grainy, "vignetting and grain is None", Acts(picture=True)),
    ],
)
def test_lens_shutter_and_exposure_are_compared(change, words, allowed):
    found = faults(change)
    assert len(found) == 1 and words in found[0]
    assert not faults(change, allowed)


# Laws ---------------------------------------------------------------------------------------

FULL = """
scenario: {folder: .}
sky: {sun: {azimuth: 120, elevation: 20}, turbidity: 3, rotation: 10}
weather:
  fog: {visibility: 300 m, height: 20 m}
  rain: {rate: 3}
  wind: {speed: 3 m/s, from: 90}
  wetness: 0.3
vehicles: {by_id: {v0: {colour: "#ff0000", model: sedan}}}
traffic: {leave_out: [v1], rides: {v0: {delay: 1 s}}}
cameras:
  post:
    mode: eulerian
    position: [0, -10, 3]
    look_at: [20, 0, 1]
    lens: {f_number: 4, focus: 20}
    shutter: {time: 1/50 s}
    exposure: {mode: auto, ev: 1}
shots: [{camera: post, from: 2, to: 4}]
overlays: {text: [{text: How near?, from: 1, to: 2}], before: [{text: Ready}]}
output: {exposure: 1}
"""
"""A scene with all that has settings of its own."""

SEEN_ELSEWHERE = {
    "output.exposure": "exposure", "output.tone": "tone", "output.glare": "glare",
    "output.response": "response",
    "output.layers": "beside the film, and in no picture",
}  # fmt: skip
"""Keys of a scene that other parts of an account tell."""


def leaves(value, path=()):
    """All values of plain settings, with where they stand."""
    if isinstance(value, dict) and value:
        pairs = value.items()
    elif isinstance(value, list) and any(isinstance(each, dict) for each in value):
        pairs = enumerate(value)
    else:
        return [(path, value)]
    return [leaf for key, each in pairs for leaf in leaves(each, (*path, key))]


def full_scene(folder):
    write_scenario(folder)
    (folder / "full.yaml").write_text(FULL, encoding="utf-8")
    job = load_job(folder / "full.yaml")
    return json.loads(json.dumps(with_files(job.model_dump(by_alias=True), str), default=str))


def test_every_setting_of_a_scene_is_told_and_is_a_confound_beside_another_factor(tmp_path):
    scene = full_scene(tmp_path)
    all_ = leaves(scene)
    assert len(all_) > 100 and ("sky", "sun", "elevation") in [path for path, _ in all_]
    untold, unconfounded = [], []
    colour = "vehicles.by_id.v9.colour: #ffffff -> #c00000"
    for path, value in all_:
        one, other = copy.deepcopy(account()), copy.deepcopy(account())
        one["scene"], other["scene"] = scene, copy.deepcopy(scene)
        inner = other["scene"]
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = "another" if value != "another" else "a third"
        key = ".".join(map(str, path))
        if key not in SEEN_ELSEWHERE and not account_faults(one, other, NOTHING, ()):
            untold.append(key)
        if not subject_of([colour, f"{key}: {value} -> another"]).confounds:
            unconfounded.append(key)
    assert not untold
    alike = ("vehicles.", "template", "output.layers")  # of the same subject, or of none
    assert not [key for key in unconfounded if not key.startswith(alike)]


def test_every_part_of_an_account_is_compared(tmp_path):
    """Also parts that nobody thought of: a new one is told until a check knows it."""
    whole = account() | {"shutter": {"open": 0.02}, "optics": {"grain": 0.1}, "seed": 7,
                         "metering": {"mode": "auto"}, "preset": {"spp": 4},
                         "package": {"code": "1"},
                         "shot": {"from": 1.0}, "camera": "post", "overlays": {"frames_before": 0},
                         "new": 1}  # fmt: skip
    for key in whole.keys() - {"plan", "fps", "shot"}:
        other = copy.deepcopy(whole)
        other[key] = changed(other[key])
        assert account_faults(whole, other, NOTHING, ()), key
    for key in whole["frames"][0].keys() - {"frame", "placed"} | {"weather"}:
        other = copy.deepcopy(whole)
        other["frames"][1][key] = changed(other["frames"][1].get(key))
        assert account_faults(whole, other, NOTHING, ()), key


def changed(value):
    """Another value of the same kind."""
    if isinstance(value, dict):
        first = sorted(value)[-1]
        return {**value, first: changed(value[first])}
    if isinstance(value, list):
        return [*value[:-1], changed(value[-1])] if value else ["more"]
    return f"{value}x" if isinstance(value, str) or value is None else value + 1


# All that moves ---------------------------------------------------------------------------------

LOG = ("scenario.trajectories: a.xml -> b.xml",)


def test_a_level_that_swaps_the_log_says_how_many_road_users_differ():
    other = copy.deepcopy(account())
    elsewhere(other)
    users = other["road_users"]
    users["vehicle:c"] = dict(users["vehicle:a"])
    said = moving_otherwise(account(), other, acts_of(LOG), LOG)
    assert said.startswith("its levels change the whole traffic log, so everything that moves may")
    assert ": of 3 road users that these films show, 1 is in one of them only and 1 of the" in said
    assert "of the others moves otherwise; what is proven is proven of the rest" in said
    signals = ("signals.offset: 0 -> 9",)
    assert "may change all traffic" in moving_otherwise(account(), other, acts_of(signals), signals)


def test_a_ride_that_is_moved_alone_is_no_other_log():
    ride = ("traffic.rides.b.delay: 0 -> 1",)
    other = copy.deepcopy(account())
    elsewhere(other)
    assert moving_otherwise(account(), other, acts_of(ride), ride) == ""
