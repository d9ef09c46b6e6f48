"""Dr.Jit gets the libLLVM that we name, or none, and says nothing of its own about it."""

from __future__ import annotations

import _ctypes
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sumo3dviz_pt.render import loading
from sumo3dviz_pt.render.loading import LIBRARY

RENDER = (
    "from sumo3dviz_pt.render.backend import try_out; import os\n"
    "print(try_out().variant, os.environ.get('DRJIT_LIBLLVM_PATH', 'nothing'))"
)
ABORTS = "/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1"  # Debian 12 and Ubuntu 22.04


def rendered(code: str = RENDER, **variables: str) -> subprocess.CompletedProcess[str]:
    inherited = {k: v for k, v in os.environ.items() if k != "DRJIT_LIBLLVM_PATH"}
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env=inherited | variables,
    )


@pytest.mark.parametrize("path", [_ctypes.__file__, "no such file", ABORTS])
def test_what_cannot_be_used_is_not_loaded(path: str) -> None:
    """15 would end the process at the first kernel; where it is not here it is just missing."""
    done = rendered(DRJIT_LIBLLVM_PATH=path)
    assert done.stdout.split(maxsplit=1) == ["scalar_rgb", f"{path}\n"]
    (said,) = done.stderr.splitlines()
    assert said.startswith(
        "rendering takes three to nine times as long as it need: DRJIT_LIBLLVM_PATH"
    )


@pytest.mark.skipif(bool(LIBRARY.problem), reason="no libLLVM of 16 or newer here")
def test_the_file_that_was_found_is_the_one_that_compiles() -> None:
    done = rendered()
    assert done.stdout.split() == ["llvm_ad_rgb", LIBRARY.path] and not done.stderr


def test_a_program_that_chose_otherwise_before_is_told() -> None:
    code = f"import mitsuba\n{RENDER.replace('try_out().variant', 'try_out().note')}"
    done = rendered(code, DRJIT_LIBLLVM_PATH=_ctypes.__file__)
    assert "older than version 16" in done.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="how Linux finds libraries")
def test_libatomic_of_a_conda_environment_is_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The wheels look in the system's folders only, unless it is loaded already."""
    place = tmp_path / "lib" / "libatomic.so.1"
    place.parent.mkdir()
    shutil.copy(_ctypes.__file__, place)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    loading._atomics_of_conda()
    assert str(place) in Path("/proc/self/maps").read_text("utf-8")
