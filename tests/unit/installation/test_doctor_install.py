"""`doctor --install` from beginning to end, with package managers that only pretend."""

from __future__ import annotations

import builtins
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.cli.installed import _agreed
from sumo3dviz_pt.installation.packages import LLVM, MANAGERS, InstallOrder

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="programs here are shell scripts"),
]
ROOT = Path(__file__).resolve().parents[3]
LOST = "libatomic.so.1: cannot open shared object file: No such file or directory"


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """Where Dr.Jit cannot be loaded until apt-get has been there."""
    (tmp_path / "drjit").mkdir()
    (tmp_path / "drjit" / "__init__.py").write_text(
        f"raise ImportError({LOST!r})\n", encoding="utf-8"
    )
    return tmp_path


def program(machine: Path, name: str, script: str) -> None:
    path = machine / "bin" / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(0o755)


def doctor(machine: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    (machine / "bin").mkdir(exist_ok=True)
    code = (
        "import os, sys; os.geteuid = lambda: 0\n"
        "from sumo3dviz_pt.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    return subprocess.run(
        [sys.executable, "-c", code, "doctor", *arguments],
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        env=os.environ
        | {
            "PATH": str(machine / "bin"),
            "PYTHONPATH": os.pathsep.join([str(machine), str(ROOT)]),
        },
    )


MENDS = 'case "$*" in *install*) /bin/rm -r {0}/drjit;; esac; echo "apt-get here: $*"'
ENV = 'shift; exec "$@"'


def test_installs_and_looks_again(machine: Path) -> None:
    program(machine, "apt-get", MENDS.format(machine))
    program(machine, "env", ENV)
    done = doctor(machine, "--install", "--yes")
    lines = done.stdout.splitlines()
    assert lines[0] == "missing: libatomic"
    assert lines[1].startswith("$ env DEBIAN_FRONTEND=noninteractive ")
    assert lines[2].startswith("apt-get here: install ") and lines[2].endswith(" libatomic1")
    assert done.returncode == 0 and "does not work" not in done.stdout


def test_says_what_it_would_do_where_nobody_can_be_asked(machine: Path) -> None:
    program(machine, "apt-get", MENDS.format(machine))
    done = doctor(machine, "--install")
    assert "nobody is there to ask; with --yes this would run: apt-get install" in done.stdout
    assert (machine / "drjit").exists() and done.returncode == 1


@pytest.mark.parametrize(
    ("script", "said"),
    [("", "no package manager that we know"), ("exit 100", "apt could not install libatomic1")],
)
def test_says_in_a_sentence_that_it_cannot(machine: Path, script: str, said: str) -> None:
    if script:
        program(machine, "apt-get", script)
        program(machine, "env", ENV)
    done = doctor(machine, "--install", "--yes")
    assert f"not everything was installed: {said}" in done.stdout and not done.stderr
    assert done.returncode == 1, "nothing can be rendered"


@pytest.mark.parametrize(
    ("typed", "agreed"), [("", True), ("Y", True), ("no", False), (None, False)]
)
def test_asks_who_is_there(
    monkeypatch: pytest.MonkeyPatch, typed: str | None, agreed: bool
) -> None:
    prompts: list[str] = []

    def answer(prompt: str) -> str:
        prompts.append(prompt)
        if typed is None:
            raise EOFError
        return typed

    monkeypatch.setattr(builtins, "input", answer)
    brew = next(manager for manager in MANAGERS if manager.name == "brew")
    assert _agreed(InstallOrder(brew, "brew", (LLVM,), interactive=True)) == agreed
    assert prompts == ["install by: brew install llvm [Y/n] "]


def test_yes_without_install_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--yes"]) == 2
    assert capsys.readouterr().err == "sumo3dviz-pt: --yes: goes with --install\n"
