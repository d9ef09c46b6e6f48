"""What is wrong is said before any work: nothing long is read and no renderer is loaded."""

import os
import subprocess
import sys

import pytest
from builders import complaints, fcd_xml, network_xml, write_scenario

import sumo3dviz_pt as sv
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.pipeline.scene_file import load_job

STILL = ["still", "{scene}", "--time", "4.5", "-o", "{out}/a.png"]
RENDER = ["render", "{scene}", "--from", "4", "--to", "4.2", "-o", "{out}/a.mp4"]
CHECK = ["check", "{scene}"]

WRONG_FOR_ALL = {
    "codec": ("output: {size: [64, 36], codec: h266}\n", "did you mean 'h264'"),
    "tone": ("output: {size: [64, 36], tone: agy}\n", "did you mean 'agx'"),
    "sky": ("sky: {preset: sky_blu}\n", "did you mean 'sky_blue'"),
    "surface": ("ground: {texture: ground_gras}\n", "did you mean 'ground_grass'"),
    "smoother": ("motion: {smoother: papr}\n", "did you mean 'paper'"),
    "model": ("vehicles: {passenger: [sedam]}\n", "did you mean 'sedan'"),
    "tree": ("objects: {trees: {model: mapel}}\n", "did you mean 'maple'"),
    "picture": ("roads: {surface: none.png}\n", "there is no image file"),
    "sky's file": ("sky: {file: none.hdr}\n", "no such file"),
    "user's model": ("vehicles: {user_models: {car: none.glb}}\n", "there is no file"),
}
"""Keys of a scene file, and words of the one sentence that every command says."""

WRONG_CHOICES = {
    "variant": (["--variant", "lvm"], "did you mean 'llvm'"),
    "size": (["--size", "99999x36"], "16384"),
    "quality": (["--quality", "drat"], "did you mean 'draft'"),
    "camera": (["--camera", "pots"], "did you mean 'post'"),
    "override": (["--set", "output.codec=h266"], "did you mean 'h264'"),
}


def scenario(folder, *more, **traffic):
    """A scene whose network breaks off: whoever reads it complains about that."""
    scene = write_scenario(folder, **traffic)
    text = scene.read_text(encoding="utf-8").replace("output: {size: [64, 36], fps: 10}\n", "")
    scene.write_text(text + "".join(more), encoding="utf-8")
    (folder / "out").mkdir()
    return scene


def torn(folder):
    path = folder / "net.net.xml"
    path.write_text(path.read_text(encoding="utf-8")[:300], encoding="utf-8")


def run(arguments, scene, capsys):
    places = {"{scene}": str(scene), "{out}": str(scene.parent / "out")}
    filled = arguments
    for old, new in places.items():
        filled = [each.replace(old, new) for each in filled]
    code = main(filled)
    return code, complaints(capsys.readouterr().err)


@pytest.mark.parametrize("command", [CHECK, STILL, RENDER], ids=lambda each: each[0])
@pytest.mark.parametrize("name", WRONG_FOR_ALL)
def test_wrong_settings_are_said_before_anything_is_read(name, command, tmp_path, capsys):
    settings, words = WRONG_FOR_ALL[name]
    scene = scenario(tmp_path, settings)
    torn(tmp_path)
    code, said = run(command, scene, capsys)
    assert code == 2 and len(said) == 1 and words in said[0]
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("command", [STILL, RENDER], ids=lambda each: each[0])
@pytest.mark.parametrize("name", WRONG_CHOICES)
def test_wrong_choices_are_said_before_anything_is_read(name, command, tmp_path, capsys):
    choice, words = WRONG_CHOICES[name]
    scene = scenario(tmp_path)
    torn(tmp_path)
    code, said = run([*command, *choice], scene, capsys)
    assert code == 2 and len(said) == 1 and words in said[0]


def test_wrong_settings_of_a_scene_file_are_named_with_line_and_column(tmp_path):
    scene = scenario(tmp_path, "output:\n  codec: h266\nsky: {preset: sky_blu}\n")
    with pytest.raises(ConfigError) as caught:
        load_job(scene)
    line = scene.read_text(encoding="utf-8").splitlines().index("  codec: h266") + 1
    assert (caught.value.line, caught.value.column) == (line, 3)
    assert "(and 1 more)" in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        [*STILL, "--variant", "lvm"],
        [*STILL, "--set", "sky.preset=sky_blu"],
        [*RENDER, "--set", "output.codec=h266"],
        [*RENDER, "--size", "0x9"],
        [*CHECK, "--set", "output.codec=h266"],
    ],
)
def test_no_renderer_is_loaded_for_it(arguments, tmp_path):
    scene = scenario(tmp_path)
    filled = [a.replace("{scene}", str(scene)).replace("{out}", str(tmp_path)) for a in arguments]
    code = (
        "import sys; from sumo3dviz_pt.cli import main; code = main(sys.argv[1:])\n"
        "sys.exit(9 if {'mitsuba', 'drjit'} & set(sys.modules) else code)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, *filled], capture_output=True, check=False)
    assert done.returncode == 2, done.stderr


# A log of another network ------------------------------------------------------------------

BREAKS_OFF = '<timestep time="3000"><vehicle id="late" x="no"'


@pytest.mark.parametrize("command", [CHECK, STILL, RENDER], ids=lambda each: each[0])
@pytest.mark.parametrize(
    ("log", "words"),
    [
        (fcd_xml(end=60.0).replace('lane="', 'lane="north_'), 'such as "north_w_'),
        (fcd_xml(end=60.0, offset=(9e4, 0.0)), "the first vehicle is at (8"),
        (fcd_xml(end=60.0, offset=(0.0, 300.0)), "vehicles that drive are on its roads"),
    ],
    ids=["lanes", "far", "beside"],
)
def test_a_log_of_another_network_is_refused_by_its_beginning(
    log, words, command, tmp_path, capsys
):
    scene = scenario(tmp_path)
    # What comes later breaks off, and was not read.
    (tmp_path / "fcd.xml").write_text(log.replace("</fcd-export>", BREAKS_OFF), encoding="utf-8")
    code, said = run(command, scene, capsys)
    assert code == 2 and len(said) == 1
    assert "fcd.xml: the log does not lie on the network (net.net.xml)" in said[0]
    assert words in said[0] and "use the log of this network" in said[0]


def test_a_few_unknown_lanes_are_a_note(tmp_path, capsys):
    scene = scenario(tmp_path)
    log = tmp_path / "fcd.xml"
    text = log.read_text(encoding="utf-8").replace('lane="w_0"', 'lane="old_0"', 3)
    log.write_text(text, encoding="utf-8")
    assert main(["check", str(scene)]) == 0
    assert 'does not have, such as "old_0"' in capsys.readouterr().err


def test_signals_of_another_network_are_a_note(tmp_path, capsys):
    scene = write_scenario(tmp_path, signals=True)
    log = tmp_path / "tls.xml"
    log.write_text(log.read_text(encoding="utf-8").replace('id="m"', 'id="z"'), encoding="utf-8")
    assert main(["check", str(scene)]) == 0
    assert "none of its traffic lights is in the network (it has z)" in capsys.readouterr().err


# Riders ------------------------------------------------------------------------------------


def long_log(folder):
    """v0 and v1 until 12 s; late is there from 40 to 44 and from 50 to 52 s."""
    rows = fcd_xml(end=60.0).splitlines()
    extra = '<vehicle id="late" x="-50" y="-4.8" angle="90" type="car" speed="0" lane="w_0"/>'
    lines = []
    for line in rows:
        time = float(line.split('"')[1]) if line.startswith("<timestep") else -1.0
        there = 40 <= time <= 44 or 50 <= time <= 52
        lines.append(line.replace("</timestep>", extra + "</timestep>") if there else line)
    (folder / "fcd.xml").write_text("\n".join(lines), encoding="utf-8")


@pytest.mark.parametrize(
    ("vehicle", "words"),
    [
        ("late", "'late' is not there at 4.5 s; the log has it from 40 to 44 s, 50 to 52 s"),
        ("latte", "no vehicle or person is called 'latte'; did you mean 'late'?"),
        ("vehicle:late", "is not there at 4.5 s; the log has it from 40 to 44 s"),
        ("nobody_like_this", "for example 'late', 'v0', 'v1' exist"),
    ],
)
def test_an_absent_rider_is_told_by_the_whole_log(vehicle, words, tmp_path, capsys):
    scene = scenario(tmp_path)
    long_log(tmp_path)
    arguments = ["--camera", "driver", "--set", f"cameras.driver.vehicle={vehicle}"]
    code, said = run([*STILL, *arguments], scene, capsys)
    assert code == 2 and len(said) == 1 and words in said[0]
    assert "cameras.driver.vehicle" in said[0]


def test_a_rider_has_to_be_there_for_the_whole_film(tmp_path):
    scene = scenario(tmp_path)
    long_log(tmp_path)
    job = sv.load(scene, {"cameras.driver.vehicle": "late"})
    with pytest.raises(
        ConfigError, match=r"not there at 44\.\d+ s; the log has it from 40 to 44 s"
    ):
        job.render(tmp_path / "a.mp4", camera="driver", start=43, end=46)


@pytest.mark.parametrize("vehicle", ["late", "latte"])
def test_a_later_shots_absent_rider_is_told_before_the_first_shot_is_read(
    vehicle, tmp_path, capsys
):
    scene = scenario(tmp_path)
    long_log(tmp_path)
    torn(tmp_path)
    text = scene.read_text(encoding="utf-8").replace("vehicle: v0", f"vehicle: {vehicle}")
    shots = "shots: [{camera: post, from: 4, to: 4.2}, {camera: driver, from: 4, to: 4.2}]\n"
    scene.write_text(text.partition("shots:")[0] + shots, encoding="utf-8")
    code, said = run(["render", "{scene}", "-o", "{out}/{shot}.mp4"], scene, capsys)
    assert code == 2 and len(said) == 1 and said[0].startswith("sumo3dviz-pt: cameras.driver")
    assert not list((tmp_path / "out").iterdir())


def test_a_dry_run_finds_a_rider_who_leaves_before_the_end(tmp_path, capsys):
    scene = scenario(tmp_path)
    long_log(tmp_path)
    ride = ["--camera", "driver", "--set", "cameras.driver.vehicle=late", "--dry-run"]
    for end, code in ((43, 0), (46, 2)):
        times = ["--from", "41", "--to", str(end)]
        found, said = run([*RENDER[:2], *times, *RENDER[-2:], *ride], scene, capsys)
        assert found == code, said
    assert "'late' is not there at 44." in said[0] and "from 40 to 44 s, 50 to 52 s" in said[0]


def test_options_of_the_stress_test_are_refused_without_it(tmp_path, capsys):
    code, said = run([*CHECK, "--camera", "driver"], scenario(tmp_path), capsys)
    assert code == 2 and "belong to --stress" in said[0]


def test_check_names_an_unknown_rider_of_a_camera_without_shots(tmp_path, capsys):
    scene = scenario(tmp_path)
    text = scene.read_text(encoding="utf-8").replace("vehicle: v0", "vehicle: v00")
    scene.write_text(text.partition("shots:")[0], encoding="utf-8")
    code, said = run(CHECK, scene, capsys)
    assert code == 2 and "no vehicle or person is called 'v00'; did you mean 'v0'" in said[0]


@pytest.mark.slow
@pytest.mark.parametrize("call", ["still(time=4.5)", "render('a.mp4')", "frames().__next__()"])
def test_python_says_what_is_not_installed_before_anything_is_read(call, tmp_path):
    scene = scenario(tmp_path)
    torn(tmp_path)
    (tmp_path / "mitsuba_oidn.py").write_text("raise ImportError('libOIDN is missing')\n")
    done = subprocess.run(
        [sys.executable, "-c", f"import sumo3dviz_pt as sv; sv.load({str(scene)!r}).{call}"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    said = done.stderr.splitlines()[-1]
    assert "InstallationError" in said and "libOIDN is missing" in said, done.stderr


# What is taken for a scene file ------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("city.sumocfg", "<configuration/>", "a configuration of SUMO"),
        ("a.net.xml", network_xml(), "a network of SUMO"),
        ("log.xml", fcd_xml(), "a vehicle log of SUMO"),
        ("tls.xml", "<tlsStates/>", "a signal log of SUMO"),
        ("trees.add.xml", "<additional/>", "a file of a simulation"),
    ],
)
@pytest.mark.parametrize("packed", [False, True])
def test_files_of_a_simulation_are_no_scene(name, text, words, packed, tmp_path, capsys):
    import gzip

    path = tmp_path / name
    path.write_bytes(gzip.compress(text.encode()) if packed else text.encode())
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert words in said and "not a scene file" in said and "sumo3dviz-pt init" in said


def test_a_folder_is_no_scene(tmp_path, capsys):
    assert main(["still", str(tmp_path), "--time", "1", "-o", str(tmp_path / "a.png")]) == 2
    assert f"sumo3dviz-pt init {tmp_path}" in capsys.readouterr().err


def test_a_picture_is_no_scene(tmp_path, capsys):
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")
    assert main(["check", str(tmp_path / "a.png")]) == 2
    assert "it is no text in UTF-8" in capsys.readouterr().err


def test_a_whole_log_is_not_read_for_it(tmp_path):
    path = tmp_path / "huge.yaml"
    with path.open("wb") as stream:
        stream.truncate(3 << 30)
    with pytest.raises(ConfigError, match="at most 1,000,000 are read"):
        load_job(path)


def test_a_batch_names_wrong_scenes_before_it_renders(tmp_path, capsys):
    (tmp_path / "a").mkdir()
    good = scenario(tmp_path / "a")
    torn(tmp_path / "a")
    bad = tmp_path / "bad.yaml"
    bad.write_text("scenario: {}\nqualty: draft\n", encoding="utf-8")
    arguments = ["render", str(good), str(bad), "-o", str(tmp_path / "{scene}.mp4")]
    assert main(arguments) == 2
    first, second = complaints(capsys.readouterr().err)
    assert "did you mean 'quality'" in first and "net.net.xml" in second


def test_input_errors_are_ours():
    assert issubclass(InputError, sv.Sumo3dvizError)
