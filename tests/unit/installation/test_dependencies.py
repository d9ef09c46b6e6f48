"""What is missing is said in one sentence, before any work, whatever is missing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from sumo3dviz_pt.errors import InstallationError
from sumo3dviz_pt.installation import dependencies
from sumo3dviz_pt.installation.dependencies import (
    DEPENDENCIES,
    Dependency,
    explained,
    load,
    missing_library,
    package_of,
    require_packages,
    version_of,
)

# As Dr.Jit 1.5 does: it falls over its own message about what is missing.
HIDDEN = "try:\n    raise ImportError({said!r})\nexcept ImportError as error:\n    unknown_name\n"
LINUX = "libatomic.so.1: cannot open shared object file: No such file or directory"
MAC = "dlopen(a.so, 0x0002): Library not loaded: @rpath/libfoo.1.dylib\n  Referenced from: a.so"


def raised(code: str) -> Exception:
    try:
        exec(code)
    except (ImportError, NameError) as error:
        return error
    raise AssertionError


@pytest.mark.parametrize(
    ("said", "library"), [(LINUX, "libatomic.so.1"), (MAC, "libfoo.1.dylib"), ("no magic", "")]
)
def test_the_missing_library_is_found_behind_other_errors(said: str, library: str) -> None:
    error = raised(HIDDEN.format(said=said))
    assert isinstance(error, NameError)
    assert missing_library(error) == library


def test_one_sentence_says_what_is_missing_and_what_mends_it() -> None:
    sentence = explained("drjit", raised(HIDDEN.format(said=LINUX)))
    assert sentence == (
        "drjit cannot be loaded: libatomic.so.1 is missing;"
        " install it with: sumo3dviz-pt doctor --install"
    )


@pytest.mark.parametrize("error", [ImportError("bad magic\nmore"), RuntimeError("bad magic")])
def test_a_broken_package_is_installed_anew(error: Exception) -> None:
    sentence = explained("numpy", error)
    assert sentence.startswith("numpy cannot be loaded: bad magic; install it anew with: ")
    assert sentence.endswith("-m pip install --force-reinstall numpy")


def test_an_error_without_words_is_named() -> None:
    assert "cannot be loaded: RuntimeError; " in explained("numpy", RuntimeError())


def test_everything_is_installed_here() -> None:
    require_packages()
    load("OpenEXR", "mitsuba_oidn")
    assert all(version_of(known.package)[0].isdigit() for known in DEPENDENCIES)
    assert version_of("no-such-package") == "missing"


def test_missing_packages_are_named_with_the_command_that_brings_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    known = (*DEPENDENCIES, Dependency("a-b", "no_module_a"), Dependency("c", "no_module_c"))
    monkeypatch.setattr(dependencies, "DEPENDENCIES", known)
    with pytest.raises(InstallationError) as refused:
        require_packages()
    words = str(refused.value)
    assert words.startswith("not installed: a-b, c; install with: ")
    assert words.endswith('-m pip install "a-b" "c"') and "\n" not in words


def test_a_command_installs_the_versions_that_we_take() -> None:
    assert '"shapely<3,>=2.1"' in dependencies._pip_command(["shapely"])


def test_what_cannot_be_loaded_is_said_by_its_package(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "broken_here.py").write_text("raise ImportError('bad magic')", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InstallationError, match="broken_here cannot be loaded: bad magic"):
        load("broken_here")
    assert package_of("yaml.reader") == "pyyaml"
    assert package_of(None) == "a package"


def test_nothing_that_may_be_missing_is_loaded_to_say_so() -> None:
    code = (
        "import sys\n"
        "class Nothing:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name in {[known.module for known in DEPENDENCIES]}: raise ImportError(name)\n"
        "sys.meta_path.insert(0, Nothing())\n"
        "import sumo3dviz_pt.cli, sumo3dviz_pt.installation.doctor\n"
        "import sumo3dviz_pt.installation.packages"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
