"""What all commands share: suggestions, lists of names, verbosity, completion."""

import logging
import re
import shutil
import subprocess
import warnings

import pytest
from builders import write_scenario

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cli import build_parser, main
from sumo3dviz_pt.cli.program import notes_on_stderr
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import meaning
from sumo3dviz_pt.video import CODECS


@pytest.fixture(autouse=True)
def levels():
    """Loggers as they were."""
    loggers = [logging.getLogger(), logging.getLogger("sumo3dviz_pt")]
    before = [(logger, logger.level, logger.handlers[:]) for logger in loggers]
    yield
    for logger, level, handlers in before:
        logger.setLevel(level)
        logger.handlers[:] = handlers


# Suggestions --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["rendr", "x"], "'rendr' is unknown; did you mean 'render'?"),
        (["xyzzy"], "'xyzzy' is unknown; known: demo, record"),
        (["render", "x", "-o", "y", "--qualty", "draft"], "did you mean '--quality'? (see"),
        (["render", "x", "-o", "y", "--qualty=draft"], "did you mean '--quality'? (see"),
        (["still", "x", "-o", "y", "--time", "1", "--zzz"], "'--zzz' is not understood (see"),
        (["check", "x", "more"], "'more' is not understood (see sumo3dviz-pt check --help)"),
        (["assets", "lits"], "did you mean 'list'?"),
        (["completion", "bsh"], "did you mean 'bash'?"),
    ],
)
def test_what_was_meant(arguments, said, capsys):
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("sumo3dviz-pt: ") and said in line


# Names in the help --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("command", "kinds"),
    [
        ("render", ("quality", "scene", "sky", "camera")),
        ("still", ("quality", "scene", "sky", "camera")),
        ("check", ("quality", "scene", "sky")),
        ("init", ("scene",)),
        ("demo", ("quality",)),
    ],
)
def test_help_lists_what_can_be_chosen(command, kinds, capsys):
    with pytest.raises(SystemExit):
        main([command, "--help"])
    words = set(capsys.readouterr().out.replace(",", " ").split())
    for kind in kinds:
        assert set(catalog.template_names(kind)) <= words, kind


def test_help_of_films_lists_codecs_and_tones(capsys):
    for command in ("render", "develop"):
        with pytest.raises(SystemExit):
            main([command, "--help"])
        words = set(capsys.readouterr().out.replace(",", " ").split())
        assert {"auto", *CODECS, "neutral", "agx"} <= words


@pytest.mark.parametrize(
    ("command", "option", "key", "range_"),
    [
        ("render", "--fps", "output.fps", "0.01 to 240"),
        ("render", "--speed", "shots.speed", "0.01 to 100"),
        ("still", "--spp", "quality.spp", "1 to 65536"),
        ("still", "--quality", "quality", ""),
        ("develop", "--tone", "output.tone", ""),
        ("develop", "--response", "output.response", ""),
        ("init", "--template", "template", ""),
    ],
)
def test_help_says_what_the_scene_file_says(command, option, key, range_):
    subs = next(a for a in build_parser()._actions if hasattr(a, "choices") and a.choices)
    action = subs.choices[command]._option_string_actions[option]
    assert meaning(key) and meaning(key) in action.help and range_ in action.help


# Verbosity ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("before", "after", "levels"),
    [
        ((), (), (False, True)),
        (("-v",), (), (True, True)),
        ((), ("-v",), (True, True)),
        (("--quiet",), (), (False, False)),
        ((), ("-q",), (False, False)),
        (("-q",), ("-v",), (True, True)),
    ],
)
def test_how_much_is_said(before, after, levels, tmp_path, capsys):
    """Of a simulation with riders, which is only said if asked for, and torn, which is a note."""
    scene = write_scenario(tmp_path, vehicles=2)
    log = tmp_path / "fcd.xml"
    text = log.read_text(encoding="utf-8")
    rider = (
        r'<person id="rider" x="\1" y="\2" angle="90" speed="10.0"/><vehicle id="v0" x="\1" y="\2"'
    )
    text = re.sub(r'<vehicle id="v0" x="(\S+)" y="(\S+)"', rider, text)
    log.write_text(text[: text.rindex("<timestep")], encoding="utf-8")
    command = ["check", str(scene), "--motion", "--set", "scenario.allow_truncated=true"]
    assert main([*before, *command, *after]) == 0
    said = capsys.readouterr().err
    assert ("samples of riders coincide" in said, "note: " in said) == levels, said


def test_the_callers_own_logging_is_left_alone(tmp_path):
    root, ours = logging.getLogger(), logging.getLogger("sumo3dviz_pt")
    before = root.handlers[:], root.level, ours.level
    for verbosity in ("-q", "-v"):
        main([verbosity, "vehicles", str(write_scenario(tmp_path, vehicles=2))])
        assert (root.handlers[:], root.level, ours.level) == before


def test_both_at_once_make_no_sense(capsys):
    assert main(["doctor", "-v", "-q"]) == 2
    assert "not allowed with" in capsys.readouterr().err


# Completion ---------------------------------------------------------------------------------


def script(shell, capsys):
    assert main(["completion", shell]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_every_command_and_preset_is_completed(shell, capsys):
    text = script(shell, capsys)
    for word in ("import-sumo3dviz", "vehicles", "highway_golden_hour", "h265_10", "powershell"):
        assert word in text, word
    flag = "-l discard-frames" if shell == "fish" else "--discard-frames"
    assert flag in text


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        (["re"], ["record", "render", "report"]),
        (["render", "scene.yaml", "--qu"], ["--quality", "--quiet"]),
        (["render", "scene.yaml", "--quality", "st"], ["standard", "study"]),
        (["-q", "chec"], ["check"]),
        (["assets", "s"], ["sheet"]),
        (["render", "-o", ""], []),
        (["develop", "x", "--tone", "a"], ["agx"]),
    ],
)
def test_bash_completes(line, offered, tmp_path, capsys):
    path = tmp_path / "completion.bash"
    path.write_text(script("bash", capsys), encoding="utf-8")
    ask = 'source "$1"; shift; COMP_WORDS=(sumo3dviz-pt "$@"); COMP_CWORD=$#;'
    ask += '_sumo3dviz_pt; printf "%s\\n" "${COMPREPLY[@]}"'
    command = ["bash", "-c", ask, "bash", str(path), *line]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == offered and done.stderr == ""


@pytest.mark.parametrize(
    ("text", "seconds"), [("59400", 59400.0), ("16:30:00", 59400.0), ("1:00:00:02.5", 86402.5)]
)
def test_times_are_read_as_sumo_writes_them(text, seconds):
    words = ["still", "a.yaml", "-o", "a.png", "--time", text]
    assert build_parser().parse_args(words).time == seconds


@pytest.mark.parametrize("text", ["noon", "16:30", "nan", "1e300", "16:-3:00"])
def test_what_is_no_time_is_refused_with_both_notations(text):
    with pytest.raises(ConfigError, match="16:30:00"):
        build_parser().parse_args(["still", "a.yaml", "-o", "a.png", "--time", text])


def test_only_our_own_sentences_reach_people(capsys):
    with notes_on_stderr(), warnings.catch_warnings():
        warnings.simplefilter("default")
        warnings.warn("overflow encountered in multiply", RuntimeWarning, stacklevel=1)
        logging.getLogger("trimesh").warning("unable to load materials from: own.mtl")
        logging.getLogger("PIL.Image").error("image file is truncated")
        logging.getLogger("sumo3dviz_pt.sumo").warning("own")
    assert capsys.readouterr().err == "sumo3dviz-pt: note: own\n"


def test_a_name_that_no_file_can_have_is_refused(tmp_path, capsys):
    words = ["render", str(write_scenario(tmp_path)), "--dry-run", "-o", f"{'9' * 400}.mp4"]
    assert main([*words, "--camera", "post", "--from", "4", "--to", "5"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("place", ["-30,5", "-30.5,-2", "-.5,1e3"])
def test_places_west_of_the_origin_are_values(place):
    options = build_parser().parse_args(["vehicles", "scene.yaml", "--kerb", place])
    assert options.kerb == place
    with pytest.raises(ConfigError, match="numbers of one place are written without spaces"):
        build_parser().parse_args(["vehicles", "scene.yaml", "--kerb", place, "-6.5"])
