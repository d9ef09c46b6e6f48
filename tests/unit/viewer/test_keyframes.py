"""Cameras as people write them, and how they get into a scene file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import CinematicCamera, KeyFrame
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.pipeline.scene_file import load_job, make_job
from sumo3dviz_pt.shot.cameras.free import build_flight
from sumo3dviz_pt.viewer.keyframes import (
    ViewerEye,
    camera_yaml,
    flight,
    free_name,
    inserted,
    key_frame,
    path_yaml,
    save_camera,
    with_frame,
)

EYE = ViewerEye(np.array([328.004, 279.996, 7.126]), 305.4321, -9.996, 0.0, 65.02)
ENTRY = camera_yaml(EYE, "new")

EYES = st.builds(
    lambda x, y, z, *angles: ViewerEye(np.array([x, y, z]), *angles),
    st.floats(-1e5, 1e5),
    st.floats(-1e5, 1e5),
    st.floats(0, 1e4),
    st.floats(0, 360),
    st.floats(-90, 90),
    st.floats(-180, 180),
    st.floats(2, 170),
)
TIMES = st.floats(-10, 1e5)

PLAIN = """# My scene
scenario: {network: a.net.xml, trajectories: fcd.xml}  # both

cameras:            # three
  one:
    mode: eulerian
    position: [1, 2, 3]
    heading: 0      # north
    # heading: 90
  'two': {mode: eulerian, position: [1, 2, 3], look_at: [0, 0, 0]}   # the middle

  # A flight.
  three:
    mode: cinematic
    keyframes:
    - {time: 1, position: [1, 2, 3], heading: 0}
    # - {time: 2, position: [1, 2, 3], heading: 0}

# What is filmed.
shots:
  - {camera: one, from: 1, to: 2}
"""

FILES = {
    "comments": PLAIN,
    "no newline at the end": PLAIN.rstrip("\n"),
    "windows": PLAIN.replace("\n", "\r\n"),
    "old mac": PLAIN.replace("\n", "\r"),
    "byte order mark": "\ufeff" + PLAIN,
    "byte order mark, no cameras": "\ufeffscenario: {folder: b}\n",
    "tabs in comments": PLAIN.replace("# north", "#\tnorth\t").replace("# three", "#\t\t"),
    "cameras last": "scenario: {folder: b}\ncameras:\n  a: {mode: eulerian, position: [0, 0, 1],"
    " heading: 3}",
    "cameras last, comment last": "scenario: {folder: b}\ncameras:\n  a: {mode: eulerian,"
    " position: [0, 0, 1], heading: 3}\n  # the end",
    "cameras first": "cameras:\n    a:\n        mode: eulerian\n        position: [0, 0, 1]\n"
    "        heading: 3\nscenario: {folder: b}\n",
    "no cameras": "scenario:\n  folder: b\n# end\n",
    "no cameras, no newline": "scenario: {folder: b}",
    "no cameras, document marks": "%YAML 1.2\n---\nscenario: {folder: b}\n...\n",
    "document marks": "---\ncameras:\n  a: {mode: eulerian, position: [0, 0, 1], heading: 3}\n"
    "scenario: {folder: b}\n...\n# after\n",
    "empty cameras": "cameras:   # none yet\n  # a: one\nscenario: {folder: b}\n",
    "anchors": "scenario: {folder: b}\ncameras: &all\n  a: &a\n    mode: eulerian\n"
    "    position: [0, 0, 1]\n    heading: 3\n  b: *a\n",
    "merged": "scenario: {folder: b}\ncameras:\n  a: &a {mode: eulerian, position: [0, 0, 1],"
    " heading: 3}\n  b:\n    <<: *a\n    heading: 4\nseed: 1\n",
    "block scalar": "scenario: {folder: b}\ncameras:\n  a:\n    mode: lagrangian\n"
    "    vehicle: >-\n      ve\n\n\n# end\nseed: 1\n",
    "flow over lines": "scenario: {folder: b}\ncameras:\n  a: {mode: eulerian,\n"
    "    position: [0,\n 0, 1], heading: 3\n  }  # a }\nseed: 1\n",
    "indented": "  scenario: {folder: b}\n  cameras:\n     a: {mode: eulerian,"
    " position: [0, 0, 1], heading: 3}\n  seed: 1\n",
    "all indented, no cameras": "  scenario: {folder: b}\n  seed: 1\n",
    "quoted": '"scenario": {"folder": b}\n"cameras":\n  "a b": {mode: eulerian,'
    ' position: [0, 0, 1], heading: 3}\n"seed": 1\n',
    "deep cameras": "scenario: {folder: b}\nobjects: {trees: {model: [cameras]}}\nseed: 1\n",
    "umlauts": "# Straße – übersicht\nscenario: {folder: straße}\ncameras:\n"
    "  büro: {mode: eulerian, position: [0, 0, 1], heading: 3}\n",
}


def write(folder, text):
    file = Path(folder) / "scene.yaml"
    file.write_bytes(text.encode("utf-8"))
    return file


def in_common(one, other):
    """How many characters two texts begin with together."""
    pairs = enumerate(zip(one, other, strict=False))
    return next((k for k, (a, b) in pairs if a != b), min(len(one), len(other)))


def split(before, after):
    """What was put in; all before and after it must be as it was."""
    head = in_common(before, after)
    tail = in_common(before[head:][::-1], after[head:][::-1])
    assert head + tail == len(before), "something else has changed"
    return after[head : len(after) - tail]


def test_a_camera_reads_as_people_write():
    assert ENTRY == (
        "  new:\n    mode: eulerian\n    position: [328, 280, 7.13]\n    heading: 305.43\n"
        "    pitch: -10\n    lens: {fov: 65}\n    clear_view: false\n"
    )


def test_a_path_reads_as_people_write():
    frames = [
        key_frame(EYE, 444),
        key_frame(ViewerEye(np.zeros(3), 359.999, roll=-2.5, fov=65), 452.04),
    ]
    assert path_yaml("path", frames) == (
        "  path:\n    mode: cinematic\n    lens: {fov: 65}\n    clear_view: false\n    keyframes:\n"
        "      - {time: 444, position: [328, 280, 7.13], heading: 305.43, pitch: -10}\n"
        "      - {time: 452.04, position: [0, 0, 0], heading: 0, roll: -2.5}\n"
    )
    wider = key_frame(ViewerEye(np.zeros(3), 10, fov=80), 460)
    assert "fov: 80}\n" in path_yaml("path", [*frames, wider])
    with pytest.raises(ConfigError, match="no key frames"):
        path_yaml("path", [])


@settings(deadline=None)
@given(EYES)
def test_a_written_camera_is_the_eye(eye):
    written = parse_yaml(camera_yaml(eye, "a"))[0]
    camera = make_job({"scenario": {"folder": "b"}, "cameras": written}).cameras["a"]
    np.testing.assert_allclose(camera.position, eye.position, atol=0.00501)
    assert abs((camera.heading - eye.heading + 180) % 360 - 180) < 0.00501
    assert camera.pitch == pytest.approx(eye.pitch, abs=0.00501)
    assert camera.roll == pytest.approx(eye.roll, abs=0.00501)
    assert camera.lens.fov == pytest.approx(eye.fov, abs=0.0501)


@settings(deadline=None)
@given(st.lists(st.tuples(EYES, TIMES), min_size=1, max_size=6), st.floats(-0.1, 1.1))
def test_a_written_path_is_what_is_played(stops, share):
    frames: tuple[KeyFrame, ...] = ()
    for eye, time in stops:
        frames = with_frame(frames, key_frame(eye, time))
    played = flight(frames)
    written = parse_yaml(path_yaml("p", frames))[0]["p"]
    rendered = CinematicCamera.model_validate(written)
    assert rendered == played
    first, last = frames[0].time, frames[-1].time
    time = first + share * (last - first)
    one, other = build_flight(played).view_at(time), build_flight(rendered).view_at(time)
    np.testing.assert_array_equal(one.world_from_camera.matrix, other.world_from_camera.matrix)
    assert one.lens == other.lens


def test_points_that_are_looked_at_survive():
    frames = load_job(example("crossing")).cameras["flight"].keyframes
    written = parse_yaml(path_yaml("p", frames))[0]["p"]
    read = CinematicCamera.model_validate(written)
    assert [frame.look_at for frame in read.keyframes] == [frame.look_at for frame in frames]


def test_frames_are_ordered_and_of_one_time_the_last_stays():
    frames: tuple[KeyFrame, ...] = ()
    for time, heading in ((5, 1), (3, 2), (9, 3), (5.0001, 4)):
        frames = with_frame(frames, key_frame(ViewerEye(np.zeros(3), heading), time))
    assert [(frame.time, frame.heading) for frame in frames] == [(3, 2), (5, 4), (9, 3)]


def test_free_names_count_from_two():
    assert free_name("path", []) == "path"
    assert free_name("path", ["path"]) == "path2"
    assert free_name("path", {"path": 0, "path2": 0, "path4": 0}) == "path3"


@pytest.mark.parametrize("kind", FILES)
def test_everything_else_stays(kind, tmp_path):
    before = FILES[kind]
    file = write(tmp_path, before)
    line = save_camera(file, "new", ENTRY)
    after = file.read_bytes().decode("utf-8")
    added = split(before, after)
    assert "position: [328, 280, 7.13]" in added
    old, new = parse_yaml(before)[0], parse_yaml(after)[0]
    assert new.pop("cameras") == {**(old.pop("cameras", None) or {}), **parse_yaml(ENTRY)[0]}
    assert new == old
    assert load_job(file).cameras["new"].heading == 305.43
    assert after.removeprefix("\ufeff").splitlines()[line - 1].strip() == "new:"
    assert [each.name for each in tmp_path.iterdir()] == ["scene.yaml"]
    save_camera(file, "more", camera_yaml(EYE, "more"))
    assert list(load_job(file).cameras)[-2:] == ["new", "more"]


@pytest.mark.parametrize("name", ["crossing", "ronda"])
def test_examples_take_one_more_path(name, tmp_path):
    before = example(name).read_bytes().decode("utf-8")
    file = write(tmp_path, before)
    frames = [
        key_frame(EYE, 450),
        key_frame(ViewerEye(np.array([310, 290, 3]), 280, -3, 0, 65), 458),
    ]
    save_camera(file, "path", path_yaml("path", frames))
    after = file.read_bytes().decode("utf-8")
    assert split(before, after).strip() == path_yaml("path", frames).strip()
    assert after.index("path:") < after.index("shots:")
    assert load_job(file).cameras["path"] == flight(frames)


def test_line_ends_and_depth_are_the_files_own(tmp_path):
    windows = write(tmp_path, FILES["windows"])
    save_camera(windows, "new", ENTRY)
    content = windows.read_bytes()
    assert content.count(b"\r\n") == content.count(b"\n")
    text, line = inserted(FILES["cameras first"], ENTRY)
    assert text.splitlines()[line - 1 : line + 2] == [
        "    new:",
        "        mode: eulerian",
        "        position: [328, 280, 7.13]",
    ]


def test_comments_stay_with_what_they_are_about():
    text, _ = inserted(PLAIN, ENTRY)
    expected = "    # - {time: 2, position: [1, 2, 3], heading: 0}\n" + ENTRY
    assert expected + "\n# What is filmed.\nshots:" in text


REFUSED = {
    "scenario: {folder: b}\ncameras: {a: {mode: eulerian, position: [0, 0, 1], heading: 3}}\n": 2,
    "scenario: {folder: b}\ncameras: {}\n": 2,
    "{scenario: {folder: b}, cameras: {}}\n": 1,
    "scenario: {folder: b}\ncameras: null\n": 2,
    "scenario: {folder: b}\ncameras:\n  !!map {}\n": 2,
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_not_written_line_by_line_is_refused(text, tmp_path):
    file = write(tmp_path, text)
    with pytest.raises(ConfigError, match="paste the camera's text there by hand") as caught:
        save_camera(file, "new", ENTRY)
    assert (caught.value.file, caught.value.line) == (file, REFUSED[text])
    assert file.read_bytes() == text.encode()
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    "text",
    [
        # What is put in here would be put in elsewhere too, or take something away.
        "scenario: {folder: b}\nobjects: &x\n  trees: null\ncameras: *x\n",
        "scenario: &s\n  folder: b\n<<: {cameras: {a: {mode: eulerian, position: [0, 0, 1],"
        " heading: 3}}}\n",
        "scenario: {folder: b}\n? cameras\n: ? a\n  : {mode: eulerian, position: [0, 0, 1],"
        " heading: 3}\n",
    ],
)
def test_what_would_change_other_settings_is_refused(text, tmp_path):
    file = write(tmp_path, text)
    with pytest.raises(ConfigError, match="by hand"):
        save_camera(file, "new", ENTRY)
    assert file.read_bytes() == text.encode()
    assert len(list(tmp_path.iterdir())) == 1


def test_a_taken_name_is_refused_with_a_free_one(tmp_path):
    file = write(tmp_path, PLAIN.replace("three:", "one2:"))
    with pytest.raises(ConfigError, match="'one' already; 'one3' is free"):
        save_camera(file, "one", camera_yaml(EYE, "one"))
    assert file.read_bytes().decode() == PLAIN.replace("three:", "one2:")


@pytest.mark.parametrize("name", ["", "a b", "1st", "a: 1", "true", "null", "../x", "a" * 61, "-a"])
def test_names_are_words(name, tmp_path):
    file = write(tmp_path, PLAIN)
    with pytest.raises(ConfigError, match="starts with a letter"):
        save_camera(file, name, camera_yaml(EYE, name))
    assert file.read_bytes().decode() == PLAIN


def test_names_in_any_alphabet_are_words(tmp_path):
    file = write(tmp_path, PLAIN)
    save_camera(file, "Überblick_2-ö", camera_yaml(EYE, "Überblick_2-ö"))
    assert "Überblick_2-ö" in load_job(file).cameras


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("scenario: {folder: b}\nseed: -3\n", "seed"),
        ("scenario: [\n", "valid YAML"),
        ("- a\n", "mapping"),
        ("", "mapping"),
        ("a: 1\na: 2\n", "stands twice"),
        ("a: 1\n---\nb: 1\n", "valid YAML"),
    ],
)
def test_a_wrong_file_is_left_as_it_is(text, message, tmp_path):
    file = write(tmp_path, text)
    with pytest.raises(ConfigError, match=message) as caught:
        save_camera(file, "new", ENTRY)
    assert str(file) in str(caught.value)
    assert file.read_bytes() == text.encode()
    assert len(list(tmp_path.iterdir())) == 1


def test_what_cannot_be_read_or_written_is_one_sentence(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        save_camera(tmp_path / "none.yaml", "new", ENTRY)
    (tmp_path / "latin.yaml").write_bytes(b"# \xff\n")
    with pytest.raises(ConfigError, match="cannot be read"):
        save_camera(tmp_path / "latin.yaml", "new", ENTRY)


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is write-protected here"
)
def test_a_write_protected_file_stays(tmp_path):
    file = write(tmp_path, PLAIN)
    file.chmod(0o444)
    with pytest.raises(ConfigError, match="cannot be written: it is write-protected"):
        save_camera(file, "new", ENTRY)
    assert file.read_bytes().decode() == PLAIN


def test_links_and_permissions_stay(tmp_path):
    folder = tmp_path / "real"
    folder.mkdir()
    file = write(folder, PLAIN)
    file.chmod(0o640)
    link = tmp_path / "scene.yaml"
    try:
        link.symlink_to(file)
    except OSError:
        pytest.skip("no links here")
    save_camera(link, "new", ENTRY)
    assert link.is_symlink()
    assert "new:" in file.read_text("utf-8")
    assert file.stat().st_mode & 0o777 == 0o640 or os.name == "nt"


WORDS = st.text(st.sampled_from("ab c#:'-\t"), max_size=12)
CAMERAS = (
    "{mode: eulerian, position: [0, 0, 1], heading: 3}",
    "\n{i}{i}mode: eulerian\n{i}{i}position: [0, 0, 1]\n{i}{i}heading: 3",
    "\n{i}{i}mode: cinematic\n{i}{i}keyframes:\n{i}{i}- {time: 1, position: [0, 0, 1], heading: 3}",
)


@st.composite
def scene_files(draw):
    """Scene files in all sorts of hands."""
    indent = " " * draw(st.integers(1, 5))

    def comment(depth):
        return draw(st.sampled_from(["", "\n", depth + "#" + draw(WORDS) + "\n"]))

    def note():
        return draw(st.sampled_from(["", " ", " #" + draw(WORDS)]))

    entries = []
    for number in range(draw(st.integers(1, 3))):
        camera = draw(st.sampled_from(CAMERAS)).replace("{i}", indent)
        entries.append(f"{indent}c{number}: {camera}{note()}\n" + comment(indent))
    cameras = f"cameras:{note()}\n" + comment("") + "".join(entries)
    keys = ["scenario: {folder: b}" + note() + "\n", "seed: 7" + note() + "\n"]
    keys += [cameras] if draw(st.booleans()) else []
    parts = [comment("") + key for key in draw(st.permutations(keys))]
    text = "".join([*parts, comment("")])
    if draw(st.booleans()):
        text = text.rstrip("\n")
    return text.replace("\n", draw(st.sampled_from(["\n", "\r\n"])))


@settings(deadline=None)
@given(scene_files())
def test_any_file_says_what_it_said_and_one_camera_more(before):
    old = parse_yaml(before)[0]
    after, line = inserted(before, ENTRY)
    added = split(before, after)
    assert added.count(":") == ENTRY.count(":") + ("cameras" not in old)
    new = parse_yaml(after)[0]
    assert new["cameras"].pop("new") == parse_yaml(ENTRY)[0]["new"]
    assert new == {"cameras": {}, **old}
    assert after.splitlines()[line - 1].strip() == "new:"
    make_job(parse_yaml(after)[0])
