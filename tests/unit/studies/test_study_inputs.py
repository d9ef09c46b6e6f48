"""A study's folder lives alone: what it was made from lies in it, and tells of no machine."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from builders import TREES, fcd_xml, network_xml, write_scenario
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.scene_file import override_values
from sumo3dviz_pt.studies.file import load_study, texts_of
from sumo3dviz_pt.studies.folder import FOLDER, _yaml, check_study_inputs, write_study_inputs
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.records import write_record

USER = "annegret"

SCENE = """scenario: {sumocfg: ../sumo/cfg/run.sumocfg}
template: abstract
cameras:
  post: {mode: eulerian, position: [30, -22, 6], look_at: [5, -3, 0]}
vehicles: {user_models: {v0: ../models/car.yaml}}
"""

STUDY = """scene: scenes/scene.yaml
design: {table: design.csv}
clip: {camera: post, from: 4, to: 5}
common: {quality: draft}
factors:
  log: {levels: {few: {}, many: {scenario: {trajectories: [LOG]}}}}
  light: {levels: {blue: {sky: {preset: sky_blue}}, own: {sky: {file: ../skies/noon.exr}}}}
  trees: {levels: {none: {}, some: {scenario: {additional: [../trees.add.xml]}}}}
overrides: {output.fps: 10}
session: {texts: texts.yaml}
"""

CONFIG = """<configuration><input><net-file value="../net/town.net.xml"/></input>
<output><fcd-output value="{log}"/></output></configuration>"""


def write(path: Path, content: str | bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A person's home, in which a study's files lie here and there; some beside it."""
    home = tmp_path / "home" / USER
    project, data = home / "project", tmp_path / "data"
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("USERPROFILE", str(home))
    log = write(project / "sumo" / "out" / "fcd.xml", fcd_xml(vehicles=2))
    write(project / "sumo" / "net" / "town.net.xml", network_xml())
    write(project / "sumo" / "cfg" / "run.sumocfg", CONFIG.format(log=log))
    many = write(data / "many" / "fcd.xml", fcd_xml(vehicles=4))
    write(project / "trees.add.xml", TREES)
    write(project / "texts.yaml", "en: {page: {start: Go}}\n")
    write(project / "scenes" / "scene.yaml", SCENE)
    write(project / "models" / "car.yaml", "mesh: parts/car.obj\n")
    write(project / "models" / "parts" / "car.obj", "mtllib ../paint/car.mtl\nv 0 0 0\n")
    write(project / "models" / "paint" / "car.mtl", "newmtl a\nmap_Kd red.png\n")
    write(project / "models" / "paint" / "red.png", b"red")
    (project / "skies").mkdir()
    write_exr(project / "skies" / "noon.exr", {"radiance": np.ones((2, 4, 3), np.float32)})
    rows = [
        f"{a},{b},{c}" for a in ("few", "many") for b in ("blue", "own") for c in ("none", "some")
    ]
    write(project / "design.csv", "\n".join(["log,light,trees", *rows]) + "\n")
    write(project / "study.yaml", STUDY.replace("LOG", str(many)))
    return home


def planned(path, **overrides):
    return plan_study(load_study(path), override_values(overrides))


def films(plan):
    return [(each.name, each.digest, each.profiles) for each in plan.stimuli]


def everything(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_inputs_make_the_same_films_on_another_machine(home, tmp_path, monkeypatch):
    plan = planned(home / "project" / "study.yaml", **{"output.size": "[64, 36]"})
    made = tmp_path / "made"
    files = write_study_inputs(made, plan, variant="llvm")
    assert len(films(plan)) == 8 and len({digest for _, digest, _ in films(plan)}) == 8
    assert {path.relative_to(made) for path in files} == set(everything(made))
    there = tmp_path / "elsewhere" / "bob"
    shutil.move(made, there)
    shutil.rmtree(home)
    shutil.rmtree(tmp_path / "data")
    monkeypatch.setenv("HOME", str(there.parent))
    again = planned(there / FOLDER / "study.yaml")
    assert films(again) == films(plan)
    assert again.trials == plan.trials and again.playlists == plan.playlists
    assert texts_of(again.file.settings).page["start"] == "Go"


def test_inputs_tell_of_no_machine(home, tmp_path):
    """Paths of the settings, names of the files: of all that lies there."""
    plan = planned(home / "project" / "study.yaml")
    write_study_inputs(home / "out", plan, variant="llvm")
    write_record(home / "out", plan, {})
    for path, content in everything(home / "out").items():
        for word in (str(tmp_path), str(home), USER):
            assert word not in str(path) and word.encode() not in content, path


def test_inputs_of_inputs_are_the_same_bytes(home):
    first, second = home / "first", home / "second"
    plan = planned(home / "project" / "study.yaml", seed="4")
    write_study_inputs(first, plan, variant="llvm")
    write_study_inputs(second, planned(first / FOLDER / "study.yaml"), variant="llvm")
    assert everything(first) == everything(second)
    before = {path: path.stat().st_mtime_ns for path in first.rglob("*")}
    write_study_inputs(first, planned(first / FOLDER / "study.yaml"), variant="llvm")
    assert {path: path.stat().st_mtime_ns for path in first.rglob("*")} == before


def test_a_study_is_not_replaced_by_what_is_read_from_it(home):
    write_study_inputs(home, planned(home / "project" / "study.yaml"), variant="llvm")
    own = home / FOLDER / "study.yaml"
    check_study_inputs(home, planned(own))
    with pytest.raises(ConfigError, match=r"study\.yaml is what the study is read from.*another"):
        check_study_inputs(home, planned(own, seed="5"))


def test_files_of_one_folder_lie_beside_the_study_file(tmp_path):
    write_scenario(tmp_path, trees=True)
    text = "scene: scene.yaml\nfactors: {a: {levels: {x: {}, y: {seed: 2}}}}\n"
    write(tmp_path / "study.yaml", f"{text}clip: {{camera: post, from: 4, to: 5}}\n")
    write_study_inputs(tmp_path / "out", planned(tmp_path / "study.yaml"), variant="llvm")
    names = {path.name for path in (tmp_path / "out" / FOLDER).iterdir()}
    assert names == {
        *("README.md", "study.yaml", "scene.yaml", "net.net.xml", "fcd.xml", "types.add.xml"),
        "trees.add.xml",
    }


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=12),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(st.dictionaries(st.text(min_size=1, max_size=8), PLAIN, max_size=4))
def test_what_is_written_in_yaml_is_read(content):
    """Words such as 1e5, 12:30, on and 0o17 stay words."""
    assert parse_yaml(_yaml(content))[0] == content
    for word in ("1e5", "12:30", "on", "0o17", "null", "~", "2026-06-21", "#ff0000", "-", "a: b"):
        assert parse_yaml(_yaml({word: word}))[0] == {word: word}


def test_a_table_of_trajectories_goes_along_and_what_was_made_of_it_does_not(home, tmp_path):
    """The same films elsewhere, of the table itself; how it is understood tells films apart."""
    project = home / "project"
    rows = "".join(f"{n},a,{2 + n},-1.6\n{n},b,{20 - n},1.6\n" for n in range(9))
    write(project / "tracks.csv", f"t,who,x,y\n{rows}")
    table = "{file: ../tracks.csv, columns: {id: who}}"
    scenario = f"{{network: ../sumo/net/town.net.xml, trajectories: {table}}}"
    scene = SCENE.replace("{sumocfg: ../sumo/cfg/run.sumocfg}", scenario)
    write(project / "scenes" / "scene.yaml", scene)
    front = "{scenario: {trajectories: {point: front}}}"
    text = STUDY.replace(
        "{few: {}, many: {scenario: {trajectories: [LOG]}}}", f"{{few: {{}}, many: {front}}}"
    )
    write(project / "study.yaml", text)
    plan = planned(project / "study.yaml", **{"output.size": "[64, 36]"})
    assert len({digest for _, digest, _ in films(plan)}) == 8
    there = tmp_path / "made"
    names = {path.name for path in write_study_inputs(there, plan, variant="llvm")}
    assert "tracks.csv" in names and not any(name.startswith("log.") for name in names)
    shutil.rmtree(home)
    assert films(planned(there / FOLDER / "study.yaml")) == films(plan)
