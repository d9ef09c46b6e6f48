"""`compare`: what differs between two pictures or films, in words."""

import json
import shlex
from dataclasses import replace

import numpy as np
import pytest
from builders import box, constant_sky, diffuse, scene_of, static

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.cli.options import command_in
from sumo3dviz_pt.model.scene import Slots
from sumo3dviz_pt.pipeline.accounts import light_digest, plan_digest, world_digest
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.provenance import differences

ACCOUNT = {
    "key": "a",
    "command": "sumo3dviz-pt still a.yaml",
    "camera": "post",
    "time": 4.0,
    "exposure": 0.5,
    "variant": "llvm",
    "scene": {
        "seed": 3,
        "sky": {"preset": "sky_blue", "sun": None},
        "cameras": {"post": {"position": [1.0, 2.0, 3.0]}},
        "shots": [{"camera": "post", "from": 4.0, "to": 5.0}],
        "output": {"tone": "agx"},
    },
    "preset": {"spp": 4},
    "shot": {"from": 4.0, "fps": 25, "frames": 50},
    "inputs": {"fcd.xml": "1", "net.xml": "2"},
    "versions": {"mitsuba": "3.9.1"},
    "package": {"code": "1", "library": "2"},
    "world": "1",
    "light": "1",
    "plan": "2",
    "frames": [
        {"time": 4.0, "camera": {"fov": 50}, "drawn": ["vehicle:a"]},
        {"time": 4.1, "camera": {"fov": 50}, "drawn": ["vehicle:a"]},
    ],
}


def changed(path, value):
    """The account with another value at a place."""
    account = json.loads(json.dumps(ACCOUNT))
    here = account
    for key in path[:-1]:
        here = here[key]
    if value is None:
        del here[path[-1]]
    else:
        here[path[-1]] = value
    return account


CASES = [
    (("scene", "seed"), 8, "seed: 3 -> 8"),
    (("scene", "sky", "preset"), "dusk", "sky.preset: sky_blue -> dusk"),
    (("scene", "sky", "sun"), {"azimuth": 10}, "sky.sun.azimuth: only the second has it"),
    (
        ("scene", "cameras", "post", "position"),
        [1.0, 2.0, 4.0],
        "cameras.post.position: [1.0, 2.0, 3.0] -> [1.0, 2.0, 4.0]",
    ),
    (("scene", "shots", 0, "to"), 6.0, "shots.0.to: 5.0 -> 6.0"),
    (("preset", "spp"), 16, "quality preset: spp: 4 -> 16"),
    (("shot", "frames"), 48, "shot: frames: 50 -> 48"),
    (("inputs", "fcd.xml"), "9", "input fcd.xml: other content"),
    (("inputs", "net.xml"), None, "input net.xml: only the first has it"),
    (("versions", "mitsuba"), "3.9.2", "version of mitsuba: 3.9.1 -> 3.9.2"),
    (("package", "code"), "9", "our own code: other content"),
    (("camera",), "driver", "camera: post -> driver"),
    (("time",), 5.0, "time: 4.0 -> 5.0"),
    (("variant",), "scalar", "variant: llvm -> scalar"),
    (("device",), "NVIDIA H200, CUDA 12.4", "device: only the second has it"),
    (("world",), "9", "roads, houses, plants, lamps or their materials are others"),
    (("light",), "9", "sky, sun or air are others"),
    (("plan",), "9", "the shot shows other bodies, or has other room for them"),
    (("frames", 1, "drawn"), [], "frames that show others on the road: 1, the first is 1"),
    (
        ("frames", 0, "camera"),
        {"fov": 49},
        "frames that are seen from elsewhere: 1, the first is 0",
    ),
]


@pytest.mark.parametrize(("path", "value", "words"), CASES, ids=lambda value: str(value)[:30])
def test_what_differs_is_said(path, value, words):
    said = differences(ACCOUNT, changed(path, value))
    assert words in said and len(said) == 1


def test_nothing_differs():
    assert differences(ACCOUNT, changed(("command",), "another")) == []
    assert differences(ACCOUNT, changed(("key",), "b")) == []


def test_frames_are_kept_whatever_develops_them():
    for path, value in ((("scene", "output", "tone"), "srgb"), (("scene", "shots"), [])):
        other = changed(path, value)
        assert differences(ACCOUNT, other) and not differences(ACCOUNT, other, stored=True)


def test_the_command_is_like_diff(tmp_path, capsys):
    for name, account in (
        ("a", ACCOUNT),
        ("b", changed(("command",), "sumo3dviz-pt still b.yaml")),
        ("c", changed(("scene", "seed"), 8)),
    ):
        (tmp_path / f"{name}.json").write_text(json.dumps(account), encoding="utf-8")

    def compared(one, other):
        code = main(["compare", str(tmp_path / f"{one}.json"), str(tmp_path / f"{other}.json")])
        return code, capsys.readouterr().out

    assert compared("a", "a") == (0, "nothing differs\n")
    code, said = compared("a", "b")
    assert code == 0 and said.startswith("nothing differs\ncommands: sumo3dviz-pt still a.yaml\n")
    assert compared("a", "c") == (1, "seed: 3 -> 8\n")


@pytest.mark.parametrize(
    "words",
    [
        ["still", "a b.yaml", "-o", "x.png", "--time", "4"],
        ["still", "a b.yaml", "-ox.png", "--time", "4"],
        ["still", "--output", "x.png", "a b.yaml", "--time", "4"],
        ["still", "--out=x.png", "a b.yaml", "--time", "4"],
    ],
)
def test_commands_are_told_as_given_but_for_the_output(words):
    assert command_in(words) == "sumo3dviz-pt still 'a b.yaml' --time 4"


@pytest.mark.parametrize(
    "more",
    [
        ["--frames", "0:50", "--resume"],
        ["--frames=0:50", "--overwrite"],
        ["--shot", "2", "-q"],
        ["--discard-frames", "--verbose"],
    ],
)
def test_commands_are_told_without_what_no_picture_shows(more):
    """Parts of a film, and the whole, have the same bytes."""
    words = ["render", "a.yaml", *more, "--set", "output.half=false", "-o", "x.mp4"]
    assert command_in(words) == "sumo3dviz-pt render a.yaml --set output.half=false"


def test_other_options_stay():
    words = ["render", "a.yaml", "--final-exr", "--set", "output.half=false", "-o", "x.mp4"]
    told = "sumo3dviz-pt render a.yaml --final-exr --set output.half=false"
    assert command_in(words) == told


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("/srv/ann/my study/scene.yaml", "scene.yaml"),
        ("../../ann/scene.yaml", "scene.yaml"),
        (r"D:\ann\scene.yaml", "scene.yaml"),
        ("sky.file=/srv/ann/a sky.exr", "sky.file=a sky.exr"),
        ("sky={file: /srv/ann/a.exr, rotation: 3}", "sky={file: a.exr, rotation: 3}"),
        ("scenario.additional=[/srv/ann/a.xml, ~/b.xml]", "scenario.additional=[a.xml, b.xml]"),
        ("examples/crossing/scene.yaml", "examples/crossing/scene.yaml"),
        ("output.fps=30000/1001", "output.fps=30000/1001"),
        ("tools.url=https://example.org/s/", "tools.url=https://example.org/s/"),
    ],
)
def test_commands_tell_no_place_of_this_machine(word, told):
    assert shlex.split(command_in(["study", word]))[-1] == told


# Digests ----------------------------------------------------------------------------------------


def scene(*, shift=0.0, colour=0.3, name="wall", sky=1.0, slots=2):
    mesh = box((shift, 0.0, 0.0), (1.0 + shift, 1.0, 2.0))
    parts = [static(name, mesh, "matt")]
    room = Slots({"sedan": slots})
    return scene_of(parts, {"matt": diffuse(colour)}, sky=constant_sky(sky), slots=room)


def test_digests_tell_worlds_and_plans_apart():
    worlds = [world_digest(scene(**change)) for change in (
        {}, {"shift": 0.01}, {"colour": 0.31}, {"name": "house"},
    )]  # fmt: skip
    assert len(set(worlds)) == 4
    lit = replace(scene(), sky=replace(scene().sky, exposure=1.0))
    assert world_digest(scene()) == world_digest(scene(slots=3)) == world_digest(lit)
    assert light_digest(scene()) == light_digest(scene(shift=1.0)) != light_digest(lit)
    plans = [plan_digest(scene(slots=n), frozenset(h)) for n, h in ((2, ()), (3, ()), (2, ["a"]))]
    assert len(set(plans)) == 3
    assert plan_digest(scene(), frozenset()) == plan_digest(scene(shift=1.0), frozenset())


def test_last_bits_do_not_count():
    """Processors differ there; round numbers lie well within a step of the grid."""
    rng = np.random.default_rng(1)
    for shift in (0.0, 0.00005, 1.00005, 12.5, -3.25, 250.0, *rng.uniform(-1e3, 1e3, 20)):
        assert world_digest(scene(shift=shift)) == world_digest(scene(shift=shift + 1e-12))


def test_long_commands_are_told_too():
    """A batch names many scene files; other words of a request are short."""
    words = ["render", *(f"scenes/scene_{number}.yaml" for number in range(500))]
    told = command_in([*words, "-o", "{scene}.mp4"])
    assert Request(command=told).command == told and len(told) > 10_000


def test_digests_hang_on_numbers_not_on_where_they_lie():
    mesh = box((0.0, 0.0, 0.0), (1.0, 1.0, 2.0))
    twice = [static(name, mesh, "matt") for name in "ab"]
    copies = [static(name, replace(mesh, vertices=mesh.vertices.copy()), "matt") for name in "ab"]
    moved = [twice[0], static("b", replace(mesh, vertices=mesh.vertices + 0.01), "matt")]
    worlds = [
        world_digest(scene_of(parts, {"matt": diffuse(0.3)}, sky=constant_sky(1.0)))
        for parts in (twice, copies, moved)
    ]
    assert worlds[0] == worlds[1] != worlds[2]
