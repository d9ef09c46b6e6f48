"""Installs the shared libraries that pip cannot, with the system's package manager.

The names of each manager and of its packages stand in one table; all else follows from it.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from sumo3dviz_pt.errors import InstallationError
from sumo3dviz_pt.installation.dependencies import OLDEST

ATOMIC = "libatomic"
LLVM = "libLLVM"
LIBRARIES = {"libatomic.so.1": ATOMIC}
"""Libraries without which Dr.Jit cannot be loaded, by file name."""

TellLine = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Manager:
    """A package manager.

    Attributes:
        name: What people call it.
        systems: `sys.platform` of the systems that have it.
        programs: Programs that do its work; the first one found is taken.
        install: Arguments that come before packages; `{prefix}` is Python's environment.
        packages: Its package for each library. That of libLLVM is the one that we test with.
        refresh: Arguments that fetch its index anew; none where it does so by itself.
        listing: Command that lists packages of libLLVM, where their names change with the version.
        root: Whether it needs an administrator's rights.
        environment: Variables that it wants set.
    """

    name: str
    systems: tuple[str, ...]
    programs: tuple[str, ...]
    install: tuple[str, ...]
    packages: Mapping[str, str]
    refresh: tuple[str, ...] = ()
    listing: tuple[str, ...] = ()
    root: bool = False
    environment: tuple[str, ...] = ()


_CONDA = ("conda", "mamba", "micromamba")
_CONDA_INSTALL = ("install", "--yes", "--prefix", "{prefix}", "--channel", "conda-forge")
_WINGET_AGREES = ("--accept-package-agreements", "--accept-source-agreements")

MANAGERS = (
    Manager("conda", ("linux",), _CONDA, _CONDA_INSTALL, {ATOMIC: "libgcc", LLVM: "libllvm19"}),
    Manager("conda", ("darwin",), _CONDA, _CONDA_INSTALL, {LLVM: "libllvm19"}),
    Manager("conda", ("win32",), _CONDA, _CONDA_INSTALL, {LLVM: "libllvm-c19"}),
    Manager(
        "apt",
        ("linux",),
        ("apt-get",),
        # A desktop that is looking for updates holds the lock for a while.
        ("install", "-q", "-y", "--no-install-recommends", "-o", "DPkg::Lock::Timeout=60"),
        {ATOMIC: "libatomic1", LLVM: "libllvm19"},
        refresh=("update", "-q"),
        listing=("apt-cache", "search", "--names-only", "^libllvm[0-9]+(t64)?$"),
        root=True,
        environment=("DEBIAN_FRONTEND=noninteractive",),
    ),
    Manager(
        "dnf",
        ("linux",),
        ("dnf",),
        ("install", "-y", "--setopt=install_weak_deps=False"),
        {ATOMIC: "libatomic", LLVM: "llvm-libs"},
        root=True,
    ),
    Manager(
        "pacman",
        ("linux",),
        ("pacman",),
        ("-S", "--needed", "--noconfirm"),
        {ATOMIC: "gcc-libs", LLVM: "llvm-libs"},
        root=True,
    ),
    Manager("brew", ("darwin",), ("brew",), ("install",), {LLVM: "llvm"}),
    Manager(
        "winget",
        ("win32",),
        ("winget",),
        ("install", "--exact", "--silent", *_WINGET_AGREES, "--id"),
        {LLVM: "LLVM.LLVM"},
    ),
)
"""The first one that exists here is used; conda only inside one of its environments."""


@dataclass(frozen=True, slots=True)
class InstallOrder:
    """What is to be installed, and by what.

    Attributes:
        manager: The package manager.
        program: Its program.
        libraries: What is lacking.
        interactive: Whether a person can type a password here.
    """

    manager: Manager
    program: str
    libraries: tuple[str, ...]
    interactive: bool

    def command(self, arguments: Iterable[str]) -> list[str]:
        """Return the program's command line, with an administrator's rights where it needs them."""
        own = [self.program, *(text.format(prefix=sys.prefix) for text in arguments)]
        if not self.manager.root:
            return own
        if self.manager.environment:
            own = ["env", *self.manager.environment, *own]
        if _is_administrator():
            return own
        return ["sudo", *(() if self.interactive else ("-n",)), *own]

    def in_words(self) -> str:
        """Return what a person would type."""
        chosen = [self.manager.packages[library] for library in self.libraries]
        arguments = [text.format(prefix=sys.prefix) for text in self.manager.install]
        return " ".join([Path(self.program).stem, *arguments, *chosen])


def order_for(libraries: Iterable[str], *, interactive: bool) -> InstallOrder:
    """Return how libraries can be installed here.

    Args:
        libraries: Those that are lacking: `ATOMIC`, `LLVM` or both.
        interactive: Whether a person can type a password here.

    Raises:
        InstallationError: If no package manager here has them, or it may not be used.
    """
    wanted = tuple(libraries)
    for manager in MANAGERS:
        fits = sys.platform in manager.systems and manager.packages.keys() >= set(wanted)
        if fits and (manager.name != "conda" or in_conda()):
            for program in filter(None, map(shutil.which, manager.programs)):
                return _permitted(InstallOrder(manager, program, wanted, interactive))
    known = ", ".join(dict.fromkeys(manager.name for manager in MANAGERS))
    raise InstallationError(
        f"no package manager that we know is here ({known}); install by hand: {', '.join(wanted)}"
    )


def _permitted(order: InstallOrder) -> InstallOrder:
    """Return an order if this user may carry it out."""
    if order.manager.root and not _is_administrator() and shutil.which("sudo") is None:
        raise InstallationError(
            "an administrator's rights are needed and there is no sudo; let an administrator"
            f" run: {order.in_words()}"
        )
    return order


def in_conda() -> bool:
    """Return whether this Python is an environment of conda's."""
    return (Path(sys.prefix) / "conda-meta").is_dir()


def carry_out(order: InstallOrder, tell: TellLine) -> None:
    """Install what is ordered, with a new index only if the old one does not do.

    Args:
        order: What to install.
        tell: Called with every command before it runs.

    Raises:
        InstallationError: If something could not be installed; the rest is.
    """
    packages, lacking = _packages(order)
    failed = _not_installed(order, packages, tell)
    if order.manager.refresh and (failed or lacking):
        _ran(order.command(order.manager.refresh), tell)
        packages, lacking = _packages(order)
        failed = _not_installed(order, packages, tell)
    if failed:
        raise InstallationError(
            f"{order.manager.name} could not install {' and '.join(failed)};"
            f" by hand: {order.in_words()}"
        )
    if lacking:
        raise InstallationError(
            f"{order.manager.name} knows no {' and '.join(lacking)} of version {OLDEST} or newer"
            " (this distribution has none, or there is no network)"
        )


def _packages(order: InstallOrder) -> tuple[list[str], list[str]]:
    """Return the packages to install, and the libraries for which the index has no package."""
    packages: list[str] = []
    lacking: list[str] = []
    for library in order.libraries:
        package = order.manager.packages[library]
        if library == LLVM and order.manager.listing:
            package = newest_llvm(_output(order.manager.listing), tested=package)
        (packages if package else lacking).append(package or library)
    return packages, lacking


def newest_llvm(listing: str, *, tested: str) -> str:
    """Return the package of libLLVM to take.

    Args:
        listing: A package's name at the beginning of each line.
        tested: What is taken if it is among them.

    Returns:
        The tested one, or the newest that is not too old; empty if there is none.
    """
    names = re.findall(r"^(libllvm(\d+)(?:t64)?)(?=\s|$)", listing, re.MULTILINE)
    fit = {name: int(version) for name, version in names if int(version) >= OLDEST}
    return tested if tested in fit else max(fit, key=lambda name: fit[name], default="")


def _not_installed(order: InstallOrder, packages: list[str], tell: TellLine) -> list[str]:
    """Install packages one by one, so that no failure stops another; return those that fail."""
    install = order.manager.install
    return [name for name in packages if not _ran(order.command([*install, name]), tell)]


def _ran(command: list[str], tell: TellLine) -> bool:
    """Run a command that shows its own progress; return whether it ended well."""
    tell(f"$ {' '.join(command)}")
    try:
        return subprocess.run(command, stdin=subprocess.DEVNULL, check=False).returncode == 0
    except OSError as error:
        tell(str(error))
        return False


def _output(command: tuple[str, ...]) -> str:
    """Return what a command prints; nothing if there is no such command."""
    try:
        return subprocess.run(
            command, capture_output=True, encoding="utf-8", errors="replace", check=False
        ).stdout
    except OSError:
        return ""


def _is_administrator() -> bool:
    """Return whether this process has an administrator's rights already."""
    return hasattr(os, "geteuid") and os.geteuid() == 0
