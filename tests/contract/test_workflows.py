"""Hosted workflows run our checks and the README's commands, with few rights and fixed actions."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from manual import ROOT, blocks, name_of, text_of

from sumo3dviz_pt.job.yaml12 import parse_yaml

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
BY_TAG: frozenset[str] = frozenset()
"""Actions whose digest nobody knows yet, as `owner/action@v1`; to be pinned."""

WRITES = {
    ("codeql", "analyze"): {"security-events"},
    ("nightly", "tell"): {"issues"},
    ("release", "attest"): {"id-token", "attestations"},
    ("release", "index"): {"id-token"},
    ("release", "page"): {"contents"},
}
"""Jobs that may write, and what."""


def content_of(path: Path) -> dict[str, Any]:
    """A workflow, as YAML 1.2 reads it: `on` is a word."""
    content, _ = parse_yaml(text_of(path))
    assert isinstance(content, dict)
    return content


def jobs_of(path: Path) -> dict[str, dict[str, Any]]:
    jobs = content_of(path)["jobs"]
    assert isinstance(jobs, dict)
    return jobs


def checks() -> dict[str, dict[str, Any]]:
    return jobs_of(ROOT / ".github" / "workflows" / "checks.yml")


def runs(job: dict[str, Any]) -> list[str]:
    return [step["run"] for step in job["steps"] if "run" in step]


def pythons() -> list[str]:
    """The Pythons that the package says it runs on."""
    project = tomllib.loads(text_of(ROOT / "pyproject.toml"))["project"]
    found = re.findall(r"Python :: (3\.\d+)$", "\n".join(project["classifiers"]), re.M)
    assert f">={found[0]}" == project["requires-python"]
    return found


# Actions and rights -------------------------------------------------------------------------


@pytest.mark.parametrize("path", WORKFLOWS, ids=name_of)
def test_actions_are_taken_by_digest(path: Path) -> None:
    used = re.findall(r"uses: *(.*)", text_of(path))
    assert used
    for text in used:
        digest = re.fullmatch(r"[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", text)
        assert digest or text in BY_TAG, text


def test_an_action_has_one_digest() -> None:
    """Of one repository everywhere the same, so that one request renews it."""
    texts = [text for path in WORKFLOWS for text in re.findall(r"uses: *(.*)", text_of(path))]
    pairs = {("/".join(text.split("@")[0].split("/")[:2]), text.split("@")[1]) for text in texts}
    assert len(pairs) == len({name for name, _ in pairs})


@pytest.mark.parametrize("path", WORKFLOWS, ids=name_of)
def test_jobs_have_the_rights_that_they_need(path: Path) -> None:
    assert content_of(path)["permissions"] == {}
    for name, job in jobs_of(path).items():
        rights = job["permissions"]
        assert set(rights.values()) <= {"read", "write"}
        writes = {right for right, value in rights.items() if value == "write"}
        assert writes == WRITES.get((path.stem, name), set()), name
        assert job["timeout-minutes"] <= 360


@pytest.mark.parametrize("path", WORKFLOWS, ids=name_of)
def test_no_job_keeps_a_password_or_runs_on_a_moving_system(path: Path) -> None:
    text = text_of(path)
    assert "secrets." not in text and "-latest" not in text
    checkouts = text.count("uses: actions/checkout@")
    assert text.count("persist-credentials: false") == checkouts


@pytest.mark.parametrize("path", WORKFLOWS, ids=name_of)
def test_commands_hold_no_expressions(path: Path) -> None:
    """What a stranger may choose, such as a branch's name, never becomes a piece of shell."""
    for job in jobs_of(path).values():
        assert all("${{" not in command for command in runs(job))


# What they run ------------------------------------------------------------------------------


def test_checks_run_ours_and_the_readmes_commands() -> None:
    jobs = checks()
    first, second = (block.strip() for block in blocks("sh", text_of(ROOT / "README.md"))[:2])
    assert runs(jobs["linux"]) == [".ci/run"]
    assert runs(jobs["pythons"]) == [second]
    assert runs(jobs["unix"]) == [first, second]
    assert runs(jobs["windows"]) == [
        line.replace("python3 -m", "py -m").replace("venv/bin/", "venv\\Scripts\\")
        for line in (first, second)
    ]
    assert set(content_of(WORKFLOWS[0])["on"]) >= {"push", "pull_request"}


def test_checks_run_on_every_python_that_we_name() -> None:
    jobs, named = checks(), pythons()
    assert jobs["pythons"]["strategy"]["matrix"]["python"] == named
    for job in ("unix", "windows"):
        assert jobs[job]["strategy"]["matrix"]["python"] == [named[0], named[-1]]
    set_up = [step["with"]["python-version"] for step in jobs["oldest"]["steps"][1:2]]
    assert set_up == [named[0]]


@pytest.mark.parametrize("path", WORKFLOWS, ids=name_of)
def test_files_that_they_run_exist(path: Path) -> None:
    text = "\n".join(command for job in jobs_of(path).values() for command in runs(job))
    named = re.findall(r"(?:^|[\s/\"])((?:tools|tests|\.ci)/[\w./-]+)", text)
    assert all((ROOT / name).is_file() for name in named), named


def test_the_release_is_built_by_known_files_of_tools() -> None:
    """Each tool and all that it needs has a version and hashes, and pip is told to insist."""
    for name in ("requirements", "fuzz"):
        written = text_of(ROOT / "tools" / "release" / f"{name}.in")
        asked = re.findall(r"^[\w-]+==[\d.]+$", written, re.M)
        made = text_of(ROOT / "tools" / "release" / f"{name}.txt")
        packages = re.split(r"^(?=\w)", made, flags=re.M)[1:]
        assert all(re.match(r"[\w.-]+==\S+ .*\\\n {4}--hash=sha256:", text) for text in packages)
        assert asked and set(asked) <= {text.split(" ")[0] for text in packages}
    release = text_of(ROOT / ".github" / "workflows" / "release.yml")
    for command in ("build --no-isolation", "twine check --strict", "check-wheel-contents"):
        assert command in release
    assert "cyclonedx-py" in release and "sha256sum" in release


def test_files_of_requirements_are_installed_by_their_hashes() -> None:
    texts = [text_of(path) for path in (*WORKFLOWS, ROOT / "tools" / "release" / "oldest.sh")]
    used = [line for text in texts for line in text.splitlines() if "install" in line]
    by_file = [line for line in used if " -r " in line]
    assert len(by_file) == 5 and all("--require-hashes -r" in line for line in by_file)


def test_images_are_taken_by_digest() -> None:
    bases = re.findall(r"^FROM (\S+)", text_of(ROOT / "Containerfile"), re.M)
    assert bases and len(set(bases)) == 1
    assert all(re.fullmatch(r"[\w./-]+:[\w.-]+@sha256:[0-9a-f]{64}", base) for base in bases)
