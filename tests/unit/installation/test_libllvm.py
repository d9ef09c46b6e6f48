"""Which libLLVM is named to Dr.Jit, and which is never loaded."""

from __future__ import annotations

import _ctypes
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sumo3dviz_pt.installation import dependencies
from sumo3dviz_pt.installation.dependencies import VARIABLE, find_llvm

HAVE = pytest.mark.skipif(bool(find_llvm().problem), reason="no libLLVM of 16 or newer here")


@pytest.fixture
def nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A machine on which nothing is installed but what lies in this folder."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(dependencies, "_FOLDERS", (f"{tmp_path}/llvm*/lib", str(tmp_path)))
    monkeypatch.setattr(dependencies, "_SEARCH_PATHS", {})
    monkeypatch.setattr(dependencies, "_LOADERS_OWN", {})
    return tmp_path


def old(path: Path) -> Path:
    """A shared library that has no LLVMGetVersion, like libLLVM before 16."""
    path.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(_ctypes.__file__, path)
    return path


def test_without_any_one_command_mends_it(nowhere: Path) -> None:
    found = find_llvm()
    assert (found.path, found.version) == ("", "")
    assert found.problem == ("there is no libLLVM; install one with: sumo3dviz-pt doctor --install")


@pytest.mark.parametrize(
    "name", ["libLLVM-15.so.1", "libLLVM-14.0.6.so.1", "libLLVM.so", "libLLVM.dylib", "LLVM-C.dll"]
)
def test_an_old_one_is_recognised_before_it_is_loaded(nowhere: Path, name: str) -> None:
    path = old(nowhere / name)
    found = find_llvm()
    assert not found.version
    assert found.problem.startswith(f"the newest libLLVM is {path}, which is older than version 16")


def test_names_do_not_deceive(nowhere: Path) -> None:
    old(nowhere / "libLLVM.so.99.1")
    assert "libLLVM.so.99.1, which is older than version 16" in find_llvm().problem


def test_what_is_no_library_is_refused(nowhere: Path) -> None:
    (nowhere / "libLLVM.so.19.1").write_text("no library", encoding="utf-8")
    assert "libLLVM.so.19.1, which cannot be loaded (" in find_llvm().problem


@pytest.mark.parametrize(
    "name", ["libLLVMSPIRVLib.so.15", "libLLVM-15.a", "libLLVMCore.so", "libLLVM-15.so.1.bak"]
)
def test_other_files_are_not_asked(nowhere: Path, name: str) -> None:
    old(nowhere / name)
    assert "there is no libLLVM" in find_llvm().problem


@HAVE
def test_the_newest_that_works_is_taken(nowhere: Path) -> None:
    old(nowhere / "libLLVM.so.99.1")
    old(nowhere / "llvm-15" / "lib" / "libLLVM.so.1")
    (nowhere / "llvm-19" / "lib").mkdir(parents=True)
    working = nowhere / "llvm-19" / "lib" / "libLLVM.so.1"
    working.symlink_to(real())
    found = find_llvm()
    assert found.path == str(Path(real()).resolve()) and int(found.version.split(".")[0]) >= 16


def real() -> str:
    """The libLLVM of this machine, asked for in a process with all its folders."""
    code = "from sumo3dviz_pt.installation.dependencies import find_llvm; print(find_llvm().path)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_versions_in_names_order_what_is_asked() -> None:
    names = (
        "/usr/lib/x86_64-linux-gnu/libLLVM-9.so.1",
        "/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1",
        "/opt/homebrew/Cellar/llvm@18/18.1.8/lib/libLLVM.dylib",
        "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1",
        "/opt/homebrew/Cellar/llvm/20.1.8/lib/libLLVM.dylib",
        "/opt/conda/lib/libLLVM.21.1.dylib",
    )
    assert sorted(map(Path, names), key=dependencies._version_by_name) == [
        Path(name) for name in names
    ]


def test_a_users_own_choice_is_never_replaced(
    nowhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = old(nowhere / "elsewhere" / "libLLVM-15.so.1")
    monkeypatch.setenv(VARIABLE, str(chosen))
    found = find_llvm()
    assert found.problem == (
        f"DRJIT_LIBLLVM_PATH names {chosen}, which is older than version 16;"
        " let DRJIT_LIBLLVM_PATH name version 16 or newer, or unset it"
    )
    monkeypatch.setenv(VARIABLE, str(nowhere / "none.so"))
    assert "none.so, which cannot be loaded" in find_llvm().problem


def test_the_users_search_path_is_looked_through(
    nowhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old(nowhere / "module" / "libLLVM-15.so")
    monkeypatch.setattr(dependencies, "_SEARCH_PATHS", {sys.platform: "A_SEARCH_PATH"})
    monkeypatch.setenv("A_SEARCH_PATH", str(nowhere / "module"))
    assert "libLLVM-15.so, which is older" in find_llvm().problem
