"""What is said about installing in several places is the same everywhere."""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

from sumo3dviz_pt.installation.dependencies import DEPENDENCIES
from sumo3dviz_pt.installation.packages import MANAGERS, Manager

ROOT = Path(__file__).resolve().parents[2]


def row(name: str, system: str) -> Manager:
    (found,) = [one for one in MANAGERS if one.name == name and system in one.systems]
    return found


def test_all_requirements_are_looked_for() -> None:
    with (ROOT / "pyproject.toml").open("rb") as stream:
        required = tomllib.load(stream)["project"]["dependencies"]
    # What excludes versions on some systems names a package a second time.
    names = [re.split(r"[<>=]", text)[0] for text in required if ";" not in text]
    assert names == [known.package for known in DEPENDENCIES]


def test_condas_environment_has_the_packages_of_the_table() -> None:
    made = yaml.safe_load((ROOT / "environment.yml").read_text("utf-8"))
    names = [text.split()[0] for text in made["dependencies"] if isinstance(text, str)]
    assert names == ["python", "pip", *row("conda", "linux").packages.values()]
    assert {"pip": [".[dask,sumo]"]} in made["dependencies"] and made["channels"] == ["conda-forge"]


def test_the_container_has_the_packages_of_the_table_and_an_ordinary_user() -> None:
    text = (ROOT / "Containerfile").read_text("utf-8")
    apt = row("apt", "linux")
    wanted = " ".join(apt.packages.values())
    assert f"apt-get install -q -y --no-install-recommends {wanted} \\" in text
    assert re.search(r"^USER (?!root|0)\w+$", text, re.M)
    assert 'ENTRYPOINT ["sumo3dviz-pt"]' in text
    (extras,) = re.findall(r"^ARG EXTRAS=(.*)$", text, re.M)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert set(extras.split(",")) == {"dask", "sumo"} <= set(project["optional-dependencies"])


@pytest.mark.skipif(shutil.which("sh") is None, reason="there is no shell here")
@pytest.mark.parametrize(("extras", "end"), [("dask,sumo", ".whl[dask,sumo]"), ("", ".whl")])
def test_the_container_installs_the_wheel_with_the_extras_asked_for(
    tmp_path: Path, extras: str, end: str
) -> None:
    text = (ROOT / "Containerfile").read_text("utf-8")
    (words,) = re.findall(r'^RUN pip install --no-cache-dir -c \S+ (".*") &&', text, re.M)
    wheel = tmp_path / "sumo3dviz_pt-1-py3-none-any.whl"
    wheel.touch()
    line = f"echo {words.replace('/wheels', tmp_path.as_posix())}"
    done = subprocess.run(
        ["sh", "-c", line], env={"EXTRAS": extras}, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == f"{wheel.as_posix().removesuffix('.whl')}{end}"


@pytest.mark.parametrize("manager", MANAGERS, ids=lambda one: f"{one.name}-{one.systems[0]}")
def test_the_manual_names_the_packages_of_the_table(manager: Manager) -> None:
    page = (ROOT / "docs" / "installation.md").read_text("utf-8")
    called = {"conda": "conda install", "apt": "apt-get install"}.get(manager.name, manager.name)
    (line,) = [line for line in page.splitlines() if line.startswith("|") and called in line]
    assert all(package in line for package in manager.packages.values())
