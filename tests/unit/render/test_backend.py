"""Variants and their fallback."""

import pytest

from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.installation import dependencies
from sumo3dviz_pt.installation.dependencies import Driver
from sumo3dviz_pt.render import backend
from sumo3dviz_pt.render.backend import choose_backend, llvm_description, try_out


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
    assert llvm_description() == "not in use"


def test_unknown_names_are_refused():
    with pytest.raises(ConfigError, match="did you mean 'cuda'"):
        choose_backend("cudda")


def test_a_variant_that_cannot_work_says_why():
    """On a machine with a GPU it works, and that is fine."""
    try:
        assert choose_backend("cuda").jit
    except ConfigError as error:
        assert "NVIDIA driver" in str(error) and "\n" not in str(error)


def test_a_triangle_that_is_not_seen_refuses_the_variant(monkeypatch):
    """Before anything is built, whatever the driver says of itself."""
    monkeypatch.setattr(backend, "find_driver", lambda: Driver("12.4", "a GPU", True))
    monkeypatch.setattr(backend, "_try_variant", lambda variant: None)
    assert choose_backend("cuda").variant == "cuda_ad_rgb"
    monkeypatch.setattr(backend, "answers", lambda: False)
    with pytest.raises(RenderError, match="does not see a single triangle"):
        choose_backend("cuda")


def test_an_old_llvm_falls_back_and_says_how_to_mend_it(monkeypatch, caplog):
    monkeypatch.setattr(dependencies, "OLDEST", 99)
    monkeypatch.setattr(
        backend, "LIBRARY", dependencies.Library("", "", "there is none; install it")
    )
    found = choose_backend("llvm")
    assert found.variant == "scalar_rgb" and not found.jit
    assert found.note.endswith("there is none; install it")
    assert found.note in caplog.text


def test_a_kernel_is_really_compiled():
    assert try_out().jit
