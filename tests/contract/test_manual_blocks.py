"""What the manual tells people to type is understood: commands, YAML and Python."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from manual import DOCS, PAGES, PROGRAM, ROOT, blocks, calls, commands, name_of, text_of

import sumo3dviz_pt
from sumo3dviz_pt import catalog, cli
from sumo3dviz_pt.api import Films
from sumo3dviz_pt.cli.options import overrides_of
from sumo3dviz_pt.job.sessions import LanguageSettings
from sumo3dviz_pt.job.settings import Job, ScenarioSettings
from sumo3dviz_pt.job.study import StudySettings
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.library.vehicles.user_mesh import read_user_vehicle
from sumo3dviz_pt.model.traffic import RoadUser
from sumo3dviz_pt.pipeline.films.film import FilmOrder
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job, make_job
from sumo3dviz_pt.pipeline.still import Still
from sumo3dviz_pt.proposals.sumo3dviz import translate
from sumo3dviz_pt.studies.run import StudyOrder
from sumo3dviz_pt.viewer.choices import LiveChoices

HOWTO = sorted((DOCS / "howto").glob("*.md"))
OUR_NAMES = {
    "scene": sumo3dviz_pt.Scene,
    "dusk": sumo3dviz_pt.Scene,
    "still": Still,
    "frame": Still,
    "image": Still,
    "films": Films,
    "study": sumo3dviz_pt.Study,
    "vehicle": RoadUser,
}
"""What names stand for in the manual's Python; its attributes have to exist."""

THIRD_PARTY = {"libsumo", "matplotlib", "numpy"}

every_page = pytest.mark.parametrize("page", PAGES, ids=name_of)


def every(language: str) -> pytest.MarkDecorator:
    """All blocks of a language, each named by its page and place."""
    found = [
        pytest.param(body, id=f"{name_of(page)}-{number}")
        for page in PAGES
        for number, body in enumerate(blocks(language, text_of(page)), start=1)
    ]
    return pytest.mark.parametrize("body", found)


# Commands ----------------------------------------------------------------------------------


@every_page
def test_every_command_parses(page: Path) -> None:
    parser = cli.build_parser()
    text = text_of(page)
    for words in commands(text):
        if len(words) > 1:
            parser.parse_args(words)
        elif words:
            assert f"\n## {words[0]}\n" in text_of(DOCS / "command_line.md"), words


@pytest.mark.parametrize("page", [ROOT / "README.md", *HOWTO], ids=name_of)
def test_no_command_in_a_shell_block_is_overlooked(page: Path) -> None:
    for body in blocks("sh", text_of(page)):
        lines = [line for line in body.splitlines() if not line.startswith("#")]
        if "for " not in body:
            assert len(calls(body)) == sum(line.count(f"{PROGRAM} ") for line in lines)


@every_page
def test_what_commands_choose_exists(page: Path, tmp_path: Path) -> None:
    for words in commands(text_of(page)):
        if len(words) > 1:
            check_choices(cli.build_parser().parse_args(words), tmp_path / "scene.yaml")


def check_choices(options: Namespace, scene: Path) -> None:
    """Presets and templates exist; what --set sets is valid in a scene that has the camera."""
    for kind, key in (("quality", "quality"), ("scene", "template")):
        name = getattr(options, key, None)
        assert name is None or name in catalog.template_names(kind), name
    camera = getattr(options, "camera", None) or "any"
    settings = filled({"shots": [{"camera": camera, "from": 0, "to": 1}]})
    scene.write_text(yaml.safe_dump(settings), encoding="utf-8")
    if getattr(options, "set", None):
        load_job(scene, overrides_of(options))


def test_loops_are_unrolled() -> None:
    found = calls("for a in 1 2; do\n  sumo3dviz-pt x $a ${a}.png \\\n  --set b='{c: #d}'\ndone")
    assert found == [["x", one, f"{one}.png", "--set", "b={c: #d}"] for one in "12"]
    assert calls("cd x && venv/bin/sumo3dviz-pt y | head -1  # sumo3dviz-pt z") == [["y"]]
    assert calls("sumo3dviz-pt y >> ~/file; sumo3dviz-pt z") == [["y"], ["z"]]


# YAML --------------------------------------------------------------------------------------


def filled(settings: dict[str, Any]) -> dict[str, Any]:
    """A part of a scene file with what it refers to, made up where it is not there."""
    shots = settings.get("shots", ())
    stand = {"mode": "eulerian", "position": [0, 0, 5], "heading": 0}
    cameras = {shot["camera"]: stand for shot in shots} | settings.get("cameras", {})
    return {"scenario": {"folder": "."}, **settings, "cameras": cameras}


@every("yaml")
def test_yaml_is_valid(body: str, tmp_path: Path) -> None:
    content, _ = parse_yaml(body)
    assert isinstance(content, dict)
    if "mesh" in content:
        check_user_vehicle(body, content, tmp_path)
    elif "paths" in content:
        check_of_sumo3dviz(body, content, tmp_path)
    elif all(isinstance(value, dict) and "mode" in value for value in content.values()):
        make_job(filled({"cameras": content}))
    elif set(content) <= set(StudySettings.model_fields):
        check_study(content)
    elif set(content) <= {"de", "en", "fr"}:
        for texts in content.values():
            LanguageSettings.model_validate(texts)
    else:
        assert set(content) <= set(Job.model_fields)
        make_job(filled(content))


def check_user_vehicle(body: str, content: dict[str, Any], folder: Path) -> None:
    """A user's vehicle can be read as it is written."""
    corners = "v 0 0 0\nv 12 0 0\nv 12 2 0\nv 0 2 3\nf 1 2 3\nf 1 3 4\n"
    (folder / "mesh.obj").write_text(corners, encoding="utf-8")
    (folder / "own.yaml").write_text(body.replace(content["mesh"], "mesh.obj"), encoding="utf-8")
    read_user_vehicle(folder / "own.yaml", materials={"paint", "glass"})


def check_study(content: dict[str, Any]) -> None:
    """A part of a study file is one with what it leaves out; its levels are scenes."""
    two = {"levels": {"one": {}, "two": {}}}
    study = {"scene": "scene.yaml", "factors": {"light": two, "trees": two}, **content}
    found = StudySettings.model_validate(study)
    for factor in found.factors.values():
        for patch in factor.levels.values():
            make_job(filled(dict(patch)))


def check_of_sumo3dviz(body: str, content: dict[str, Any], folder: Path) -> None:
    """A configuration of sumo3Dviz is translated as the page says."""
    for name in content["paths"].values():
        (folder / name).touch()
    (folder / "config.yaml").write_text(body, encoding="utf-8")
    text, _ = translate(folder / "config.yaml", output=folder / "out.yaml", root=folder)
    shown = blocks("yaml", text_of(DOCS / "howto" / "from_sumo3dviz.md"))
    assert parse_yaml(shown[shown.index(body) + 1])[0] == parse_yaml(text)[0]


# Python ------------------------------------------------------------------------------------


@every("python")
def test_python_uses_public_names_only(body: str) -> None:
    tree = ast.parse(body)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            check_import(node)
        elif isinstance(node, ast.Attribute):
            check_attribute(node)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            check_call(node, node.func)


def check_import(node: ast.Import | ast.ImportFrom) -> None:
    """Only the package itself, Python's own modules, and what people plot with or run."""
    names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module]
    for name in names:
        first = str(name).split(".")[0]
        assert name == "sumo3dviz_pt" or first in sys.stdlib_module_names | THIRD_PARTY, name


def check_attribute(node: ast.Attribute) -> None:
    """Nothing private, and nothing that is not there."""
    assert not node.attr.startswith("_")
    if isinstance(node.value, ast.Name):
        if node.value.id == "sv":
            assert node.attr in sumo3dviz_pt.__all__, node.attr
        elif node.value.id in OUR_NAMES:
            assert hasattr(OUR_NAMES[node.value.id], node.attr) or node.attr in annotations_of(
                OUR_NAMES[node.value.id]
            ), node.attr


def annotations_of(cls: type) -> set[str]:
    return set(getattr(cls, "__annotations__", ()))


def check_call(node: ast.Call, func: ast.Attribute) -> None:
    """Arguments that the function takes."""
    owner = func.value.id if isinstance(func.value, ast.Name) else ""
    cls = sumo3dviz_pt if owner == "sv" else OUR_NAMES.get(owner)
    if cls is None:
        return
    parameters = inspect.signature(getattr(cls, func.attr)).parameters
    taken = set(parameters)
    if func.attr == "Scene":
        taken |= set(Job.model_fields) | set(ScenarioSettings.model_fields)
    if func.attr in ("render", "frames"):
        taken |= set(Request.__slots__) | set(FilmOrder.__slots__) | set(StudyOrder.__slots__)
    if func.attr == "LiveView":
        taken |= set(LiveChoices.__slots__)
    given = {keyword.arg for keyword in node.keywords if keyword.arg is not None}
    assert given <= taken, ast.unparse(node)


# Pages -------------------------------------------------------------------------------------


@every_page
def test_links_and_pictures_lead_somewhere(page: Path) -> None:
    text = re.sub(r"^```\w*\n.*?^```", "", text_of(page), flags=re.M | re.S)
    for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)", text):
        if target.startswith("http"):
            continue
        file = (page.parent / target) if target else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), f"{target}#{anchor}"


def anchors(page: Path) -> Iterator[str]:
    """Headings as links name them."""
    headings = re.findall(r"^#+ (.*)$", text_of(page), flags=re.M)
    return (re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings)


@pytest.mark.parametrize("page", HOWTO, ids=name_of)
def test_howto_pages_say_what_to_check_and_what_can_go_wrong(page: Path) -> None:
    text = text_of(page)
    if page.name == "index.md":
        return
    assert f"({page.name})" in text_of(DOCS / "howto" / "index.md")
    assert "\n## What to check\n" in text and "\n## What can go wrong\n" in text
    assert commands(text) or blocks("python", text)


def test_nothing_is_installed_by_a_name_that_is_not_published() -> None:
    files = [
        *PAGES,
        *(ROOT / "sumo3dviz_pt").rglob("*.py"),
        *(ROOT / "tests" / "bench").glob("*.py"),
    ]
    for file in files:
        assert not re.search(r"pip install \"?sumo3dviz[-_]pt(\[|\b(?!-\d))", text_of(file)), file
