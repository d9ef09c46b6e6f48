"""The manual's commands run: on a small street, with few pixels, or dry.

Each form of a command (its options, and the keys that it sets) runs once. Whether names and times
suit the examples that the manual names is asked in `tests/contract/test_manual_examples.py`.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import pytest
from builders import SCENE, write_scenario
from manual import PAGES, commands, text_of
from table_writers import Row, common_road, drone, feet, own_metres, vissim

from sumo3dviz_pt import cli
from sumo3dviz_pt.sumo.fcd import read_trajectories

NOT_RUN = {
    "demo": "the README's first command runs in CI",
    "doctor": "`--install` asks the system's package manager",
    "view": "serves a page until it is stopped, or takes SUMO; tests/unit/exports, tests/viewer",
    "converge": "takes minutes; tests/film/test_converge.py",
    "record": "needs SUMO; tests/unit/recording",
    "import-sumo3dviz": "needs sumo3Dviz's files; tests/contract/test_manual_blocks.py",
    "check --stress": "takes minutes; tests/film/test_stress_command.py",
    "init --record": "needs SUMO",
    "init --traffic": "needs SUMO; tests/unit/recording/test_maps.py",
    "init map.xodr": "as above",
    "study verify": "needs a study's folder; tests/film/test_verify.py",
    "study pack": "as above; tests/unit/studies/test_pack.py",
    "study unpack": "as above",
    "farm status": "needs a farm that runs; tests/film/test_farm.py",
    "farm stop": "as above",
    "farm resume": "as above",
    "farm work": "as above",
    "farm --engine": "needs Slurm or Dask; tests/unit/farm",
    "study gaze": "needs films with layers; tests/unit/studies/measured/test_gaze.py",
    "study presses": "needs answers of people; tests/unit/studies/measured/test_presses.py",
    "still weather.preset=snow": "needs libLLVM; tests/film/test_weather.py",
    "still cameras.overview.shutter.angle=180": "needs libLLVM; tests/film/test_lens_films.py",
    "render --time-budget": "a pilot renders; tests/unit/pipeline/films/test_pilot.py",
    "render --target-error": "as above",
}
"""Commands, and those with an option or an action, that do not run here, and why."""

VALUES = {
    "--time": "4", "--at": "4", "--from": "4", "--to": "4.2", "--size": "32x16", "--vehicle": "v0",
    "--frames": "0:1", "--kerb": "30,-6", "--near": "post,40", "--follow": "v0", "--type": "car",
    "--tone": "agx", "--quality": "draft",
}  # fmt: skip
DRY = ("render", "study", "farm")
CAMERAS = ("overview", "corner", "eulerian", "my_view", "path")

STUDY = """scene: scene.yaml
clip: {camera: driver, from: 4, to: 4.2}
factors:
  light: {levels: {day: {template: city_day}, night: {template: city_night}}}
question: {text: "How safe?", low: not, high: very}
"""
CONFIGURATION = """<configuration><input><net-file value="net.net.xml"/>
<additional-files value="types.add.xml"/></input>
<output><fcd-output value="fcd.xml"/></output></configuration>"""


def form_of(words: list[str]) -> tuple[str, ...]:
    """What makes two commands alike: the command, an action, options, and keys that are set."""
    keys = [word.split("=")[0] for flag, word in pairwise(words) if flag == "--set"]
    ends = [Path(word).suffix for word in words[1:] if not word.startswith("-")]
    kinds = sorted({end for end in ends if re.fullmatch(r"\.[a-z]\w*", end)})
    action = words[1:2] if words[0] in ("farm", "assets", "completion") else []
    return (words[0], *action, *sorted(w for w in words if w.startswith("-")), *keys, *kinds)


def is_run(words: list[str]) -> bool:
    """Whether a command can run here."""
    parts = {f"{words[0]} {word}".strip() for word in ["", *words[1:]]} if words else set()
    return len(words) > 1 and "..." not in words and not parts & set(NOT_RUN)


def forms() -> dict[str, list[str]]:
    """One command of each form, by its page and words."""
    found: dict[tuple[str, ...], tuple[str, list[str]]] = {}
    for page in PAGES:
        for words in commands(text_of(page)):
            if is_run(words):
                found.setdefault(form_of(words), (f"{page.stem}: {' '.join(words)}"[:90], words))
    return dict(found.values())


FORMS = forms()


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a street, a scene with all cameras, a study, frames and pictures."""
    folder = tmp_path_factory.mktemp("manual")
    post = "  {name}: {{mode: eulerian, position: [30, -22, 6], look_at: [5, -3, 0]}}\n"
    more = "".join(post.format(name=name) for name in CAMERAS)
    text = SCENE.format(files="", x0=30, y0=-22, x1=5, y1=-3).replace(
        "cameras:\n", f"cameras:\n{more}"
    )
    text = text.replace("shots:\n", "shots:\n  - {camera: driver, from: 4, to: 4.2}\n")
    write_scenario(folder, vehicles=4, end=8.0, scene=text)
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    (folder / "city.sumocfg").write_text(CONFIGURATION, encoding="utf-8")
    write_other_tools(folder)
    scene = str(folder / "scene.yaml")
    film = ["--from", "4", "--to", "4.2", "--spp", "1", "--size", "32x16", "--variant", "scalar"]
    assert (
        cli.main(["render", scene, "--camera", "post", *film, "-o", str(folder / "film.mp4")]) == 0
    )
    still = ["--time", "4", *film[4:]]
    assert (
        cli.main(["still", scene, "--camera", "post", *still, "-o", str(folder / "one.exr")]) == 0
    )
    return folder


def write_other_tools(folder: Path) -> None:
    """Write the street's traffic in the forms of other tools, and a height model of the place."""
    rows = [
        Row(
            *(trace.times[n], trace.id),
            *trace.positions[n, :2],
            *(trace.yaws[n], 10.0, 4.6, 1.8),
            "passenger",
        )
        for trace in read_trajectories([folder / "fcd.xml"]).traces
        for n in range(len(trace.times))
    ]
    drone(folder, rows)
    vissim(folder, rows).rename(folder / "run.fzp")
    for name, write in {
        "tracks.csv": own_metres,
        "trajectories.csv": feet,
        "scenario.xml": common_road,
    }.items():
        write(folder, rows).rename(folder / name)
    full = (folder / "fcd.xml").read_text(encoding="utf-8").replace("fcd-export", "full-export")
    full = full.replace("<timestep time=", "<data timestep=").replace("</timestep>", "</data>")
    full = re.sub(r"(<vehicle [^>]*>)", r"<vehicles>\1</vehicles>", full)
    (folder / "full.xml").write_text(full, encoding="utf-8")
    head = "ncols 40\nnrows 40\nxllcorner -2000\nyllcorner -2000\ncellsize 100\n"
    (folder / "dem.tif").write_text(head + "7 " * 1600, encoding="ascii")


def suited(words: list[str], street: Path, output: Path) -> list[str]:
    """The same command for the small street."""
    found = [words[0]]
    for before, word in pairwise(words):
        if before == "-o":
            found.append(str(output / Path(word).name))
        elif before in VALUES and before.startswith("-"):
            found.append(VALUES[before])
        elif before == "--set":
            found.append(setting(word))
        else:
            found.append(stand_in(word, street))
    if "--kerb" in words:
        # On so short a street all cars appear in sight, and no pair is proposed unasked.
        return [*found, "--pick", "1"]
    if words[0] == "init" and "-o" not in words:
        return [*found, "-o", str(output / "scene.yaml")]
    if words[0] in DRY:
        return [*found, *([] if "--dry-run" in found else ["--dry-run"])]
    return [*found, "--spp", "1", "--variant", "scalar"] if words[0] == "still" else found


def setting(word: str) -> str:
    """A key that is set, for the small street: its car, its sky, and the plainest template."""
    plain = re.sub(r"^template=.*", "template=abstract", word)
    return re.sub(r"(vehicle: |vehicle=)[\w.]+", r"\1v0", plain).replace("my_sky.hdr", "one.exr")


def stand_in(word: str, street: Path) -> str:
    """What stands for a file."""
    ends = {".sumocfg": "city.sumocfg", ".frames": "film.frames", ".exr": "one.exr",
            ".json": "film.json", ".png": "one.exr"}  # fmt: skip
    if word.endswith(".yaml"):
        return str(street / ("study.yaml" if word.endswith("study.yaml") else "scene.yaml"))
    known = ends.get(
        Path(word).suffix, "city.sumocfg" if word in ("recorded", "run_1", "barcelona") else ""
    )
    if word == "folder":
        return str(street)
    return str(street / known) if known else word


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMS)
def test_a_command_of_the_manual_runs(
    name: str, street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(street)
    words = suited(FORMS[name], street, tmp_path)
    differ = (1,) if words[0] == "compare" else ()
    assert cli.main(words) in (0, *differ), words


def test_what_does_not_run_is_in_the_manual() -> None:
    """A reason for a command that no page has is in vain."""
    said = [words for page in PAGES for words in commands(text_of(page)) if words]
    for key in NOT_RUN:
        first, *more = key.split()
        assert any(words[0] == first and {*more} <= {*words} for words in said), key
