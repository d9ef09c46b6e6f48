"""Package managers as data, run by programs that only pretend."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from sumo3dviz_pt.errors import InstallationError
from sumo3dviz_pt.installation import packages
from sumo3dviz_pt.installation.packages import (
    ATOMIC,
    LLVM,
    MANAGERS,
    InstallOrder,
    carry_out,
    newest_llvm,
    order_for,
)

POSIX = pytest.mark.skipif(os.name == "nt", reason="programs here are shell scripts")
BOTH = (ATOMIC, LLVM)
DEBIAN = "".join(f"libllvm{n} - Modular compiler\n" for n in (13, 14, 15, 16, 19, 22))


class Machine:
    """A machine that has nothing but the programs put into one folder."""

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.folder, self._patch = folder, patch
        patch.setenv("PATH", str(folder))
        self.be("linux")

    def be(self, system: str, *, administrator: bool = True, conda: bool = False) -> None:
        self._patch.setattr(sys, "platform", system)
        self._patch.setattr(os, "geteuid", lambda: 0 if administrator else 1000, raising=False)
        prefix = self.folder / "environment"
        (prefix / "conda-meta" if conda else prefix).mkdir(parents=True, exist_ok=True)
        self._patch.setattr(sys, "prefix", str(prefix))

    def has(self, program: str, script: str = "") -> None:
        """Add a program that writes down how it was called."""
        path = self.folder / program
        path.write_text(
            f'#!/bin/sh\necho "{program} $*" >> {self.folder}/called\n{script}\n', encoding="utf-8"
        )
        path.chmod(0o755)

    def called(self) -> list[str]:
        path = self.folder / "called"
        return path.read_text("utf-8").splitlines() if path.exists() else []

    def called_of(self, program: str) -> list[str]:
        return [line for line in self.called() if line.startswith(f"{program} ")]


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    made = Machine(tmp_path, monkeypatch)
    made.has("env", 'while case "$1" in *=*) true;; *) false;; esac; do shift; done; exec "$@"')
    return made


APT = "install -q -y --no-install-recommends -o DPkg::Lock::Timeout=60"
DNF = "install -y --setopt=install_weak_deps=False"
CONDA = "install --yes --prefix {} --channel conda-forge"
AGREED = "--accept-package-agreements --accept-source-agreements"
ROWS = [
    ("apt", "linux", "apt-get", APT, ("libatomic1", "libllvm19")),
    ("dnf", "linux", "dnf", DNF, ("libatomic", "llvm-libs")),
    ("pacman", "linux", "pacman", "-S --needed --noconfirm", ("gcc-libs", "llvm-libs")),
    ("brew", "darwin", "brew", "install", ("llvm",)),
    ("winget", "win32", "winget", f"install --exact --silent {AGREED} --id", ("LLVM.LLVM",)),
    ("conda", "linux", "conda", CONDA, ("libgcc", "libllvm19")),
    ("conda", "darwin", "micromamba", CONDA, ("libllvm19",)),
    ("conda", "win32", "mamba", CONDA, ("libllvm-c19",)),
]


@POSIX
@pytest.mark.parametrize(("name", "system", "program", "arguments", "names"), ROWS)
def test_each_manager_is_called_in_its_own_way(
    machine: Machine, name: str, system: str, program: str, arguments: str, names: tuple[str, ...]
) -> None:
    (manager,) = [row for row in MANAGERS if row.name == name and system in row.systems]
    assert program in manager.programs
    machine.has(program)
    machine.has("apt-cache", f"printf '{DEBIAN}'")
    told: list[str] = []
    libraries = BOTH if len(names) == 2 else (LLVM,)
    order = InstallOrder(manager, str(machine.folder / program), libraries, interactive=False)
    carry_out(order, told.append)
    called = f"{program} {arguments.format(sys.prefix)}"
    assert machine.called_of(program) == [f"{called} {package}" for package in names]
    assert order.in_words() == f"{called} {' '.join(names)}"
    assert all(line.startswith("$ ") for line in told) and len(told) == len(names)


def test_every_manager_is_tested_and_knows_libllvm() -> None:
    tested = {(name, system) for name, system, *_ in ROWS}
    assert tested == {(row.name, system) for row in MANAGERS for system in row.systems}
    assert all(LLVM in manager.packages for manager in MANAGERS)
    assert all(ATOMIC in manager.packages for manager in MANAGERS if "linux" in manager.systems)


@pytest.mark.parametrize(
    ("listing", "package"),
    [
        (DEBIAN, "libllvm19"),
        ("libllvm16t64 - a\nlibllvm17t64 - b\nlibllvm15 - c\n", "libllvm17t64"),
        ("libllvm9 - a\nlibllvm20 - b\nlibllvm18 - c", "libllvm20"),
        ("libllvm13 - a\nlibllvm15t64 - b\nlibllvm-ocaml-dev - c\nlibllvm19-dbg", ""),
        ("", ""),
    ],
)
def test_the_tested_package_or_the_newest_that_is_new_enough(listing: str, package: str) -> None:
    assert newest_llvm(listing, tested="libllvm19") == package


@POSIX
def test_a_missing_index_is_fetched(machine: Machine) -> None:
    index = machine.folder / "index"
    machine.has("apt-get", f'[ "$1" = update ] && : > {index}; [ -e {index} ]')
    machine.has("apt-cache", f"[ -e {index} ] && printf '{DEBIAN}'")
    carry_out(order_for(BOTH, interactive=False), lambda _: None)
    calls = [(line.split()[1], line.split()[-1]) for line in machine.called_of("apt-get")]
    assert calls == [
        ("install", "libatomic1"),
        ("update", "-q"),
        ("install", "libatomic1"),
        ("install", "libllvm19"),
    ]


@POSIX
def test_a_good_index_is_not_fetched_anew(machine: Machine) -> None:
    machine.has("apt-cache", f"printf '{DEBIAN}'")
    machine.has("apt-get")
    carry_out(order_for(BOTH, interactive=False), lambda _: None)
    assert not [line for line in machine.called() if "update" in line]


@POSIX
def test_what_the_distribution_lacks_is_said_and_the_rest_installed(machine: Machine) -> None:
    machine.has("apt-get")
    machine.has("apt-cache", "echo libllvm15 - too old")
    with pytest.raises(InstallationError, match="apt knows no libLLVM of version 16 or newer"):
        carry_out(order_for(BOTH, interactive=False), lambda _: None)
    assert machine.called_of("apt-get")[-1].endswith(" libatomic1")


@POSIX
@pytest.mark.parametrize("program", ["apt-get", "dnf"])
def test_what_fails_is_told_with_what_to_do_and_the_rest_installed(
    machine: Machine, program: str
) -> None:
    machine.has(program, 'case "$*" in *llvm*) exit 100;; esac')
    machine.has("apt-cache", f"printf '{DEBIAN}'")
    said = rf"could not install (libllvm19|llvm-libs); by hand: {program} install .* lib.* .*llvm"
    with pytest.raises(InstallationError, match=said):
        carry_out(order_for(BOTH, interactive=False), lambda _: None)
    assert any(line.endswith(("libatomic1", "libatomic")) for line in machine.called_of(program))


@POSIX
@pytest.mark.parametrize(("interactive", "sudo"), [(True, "sudo env"), (False, "sudo -n env")])
def test_sudo_is_taken_where_rights_are_needed(
    machine: Machine, interactive: bool, sudo: str
) -> None:
    machine.has("apt-get")
    machine.be("linux", administrator=False)
    with pytest.raises(InstallationError, match="there is no sudo; let an administrator run: apt-"):
        order_for(BOTH, interactive=interactive)
    machine.has("sudo")
    command = order_for(BOTH, interactive=interactive).command(["update"])
    assert " ".join(command).startswith(f"{sudo} DEBIAN_FRONTEND=noninteractive ")
    assert command[-1] == "update"


def test_sudo_is_not_taken_where_rights_are_not_needed(machine: Machine) -> None:
    machine.be("darwin", administrator=False)
    brew = next(manager for manager in MANAGERS if manager.name == "brew")
    assert InstallOrder(brew, "brew", (LLVM,), interactive=True).command(["install"]) == [
        "brew",
        "install",
    ]


@POSIX
def test_a_system_without_a_manager_is_told_so(machine: Machine) -> None:
    with pytest.raises(
        InstallationError, match=r"no package manager .*by hand: libatomic, libLLVM"
    ):
        order_for(BOTH, interactive=False)
    machine.be("darwin")
    machine.has("apt-get")
    with pytest.raises(InstallationError, match="no package manager"):
        order_for((LLVM,), interactive=False)
    machine.has("brew")
    assert order_for((LLVM,), interactive=False).manager.name == "brew"


@POSIX
def test_conda_is_preferred_inside_its_environments_only(machine: Machine) -> None:
    machine.has("apt-get")
    machine.has("conda")
    assert order_for(BOTH, interactive=False).manager.name == "apt"
    machine.be("linux", conda=True)
    assert order_for(BOTH, interactive=False).manager.name == "conda"


def test_a_program_that_cannot_be_started_is_no_traceback(machine: Machine) -> None:
    told: list[str] = []
    assert not packages._ran([str(machine.folder / "nothing")], told.append)
    assert len(told) == 2
    assert packages._output((str(machine.folder / "nothing"),)) == ""
