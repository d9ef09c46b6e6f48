"""Variants and their fallback."""

import os
import sys

import pytest

from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.render import backend
from sumo3dviz_pt.render.backend import choose_backend, llvm_advice, llvm_description


@pytest.fixture(autouse=True)
def back_to_llvm():
    yield
    choose_backend("llvm")


def test_llvm_works_here():
    found = choose_backend()
    assert (found.name, found.variant, found.jit, found.note) == ("llvm", "llvm_ad_rgb", True, "")
    assert int(llvm_description().split(".")[0]) >= 16


def test_scalar_by_name():
    found = choose_backend("scalar")
    assert (found.variant, found.jit) == ("scalar_rgb", False)
    assert llvm_description().startswith("not in use; install it with: ")


def test_unknown_names_are_refused():
    with pytest.raises(ConfigError, match="did you mean 'cuda'"):
        choose_backend("cudda")


def test_a_variant_that_cannot_work_says_why():
    """On a machine with a GPU it works, and that is fine."""
    try:
        assert choose_backend("cuda").jit
    except RenderError as error:
        assert "cuda_ad_rgb does not work here: " in str(error) and "\n" not in str(error)


def test_an_old_llvm_falls_back_and_says_how_to_mend_it(monkeypatch, caplog):
    monkeypatch.setattr(backend, "_OLDEST_LLVM", (99, 0, 0))
    found = choose_backend("llvm")
    assert found.variant == "scalar_rgb" and not found.jit
    assert "too old" in found.note and "install it with" in found.note
    assert found.note in caplog.text


@pytest.mark.parametrize(("versions", "named"), [((14,), None), ((14, 17, 19), 19)])
def test_an_old_llvm_is_not_named_to_the_programs_that_we_start(
    monkeypatch, tmp_path, versions, named
):
    for version in versions:
        library = tmp_path / f"llvm-{version}" / "lib" / "libLLVM.so.1"
        library.parent.mkdir(parents=True)
        library.touch()
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.setattr(backend, "_LLVM_PLACES", (f"{tmp_path}/llvm-*/lib/libLLVM*.so*",))
    assert choose_backend("llvm").jit  # loaded before: the name is for others
    expected = str(tmp_path / f"llvm-{named}/lib/libLLVM.so.1") if named else None
    assert os.environ.pop("DRJIT_LIBLLVM_PATH", None) == expected


@pytest.mark.parametrize(
    ("system", "command"),
    [("darwin", "brew install llvm"), ("win32", "winget install LLVM.LLVM"), ("plan9", "LLVM 16")],
)
def test_advice_by_system(monkeypatch, system, command):
    monkeypatch.setattr(sys, "platform", system)
    assert command in llvm_advice()


@pytest.mark.parametrize(
    ("release", "command"),
    [
        ({"ID": "debian"}, "apt-get install libllvm"),
        ({"ID": "rocky", "ID_LIKE": "rhel fedora"}, "dnf install llvm-libs"),
        ({"ID": "arch"}, "pacman -S llvm-libs"),
        (None, "apt-get install libllvm"),
    ],
)
def test_advice_by_distribution(monkeypatch, release, command):
    def release_file():
        if release is None:
            raise OSError
        return release

    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(backend.platform, "freedesktop_os_release", release_file)
    assert command in llvm_advice()
