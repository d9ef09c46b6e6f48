"""Loads Dr.Jit and Mitsuba with a libLLVM that works, before anything else of this stage.

Dr.Jit takes its libLLVM when it is imported and never another one afterwards. Its own search
takes versions that end the process, so we always name a file to it.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

from sumo3dviz_pt.errors import InstallationError
from sumo3dviz_pt.files.quiet import silenced
from sumo3dviz_pt.installation import dependencies
from sumo3dviz_pt.installation.dependencies import explained

_NONE = "no libLLVM can be used"
"""The name that Dr.Jit is given where no libLLVM works, so that it does not search itself."""


def _loaded() -> dependencies.Library:
    """Load both; return the libLLVM that they use.

    Raises:
        InstallationError: If one cannot be loaded.
    """
    library = dependencies.find_llvm()
    try:
        if "drjit" not in sys.modules:
            _atomics_of_conda()
            with _named(library):
                import drjit  # noqa: F401
        import mitsuba  # noqa: F401
    except (ImportError, NameError) as error:
        # Where a shared library is missing, Dr.Jit's own error message fails with a NameError.
        raise InstallationError(explained("drjit", error)) from error
    return library


def _atomics_of_conda() -> None:
    """Load libatomic from Python's environment, where the system does not look for it."""
    place = Path(sys.prefix, "lib", "libatomic.so.1")
    if sys.platform == "linux" and place.is_file():
        ctypes.CDLL(str(place))


@contextmanager
def _named(library: dependencies.Library) -> Iterator[None]:
    """Name a libLLVM to Dr.Jit; programs that we start inherit the name if it works."""
    before = os.environ.get(dependencies.VARIABLE)
    os.environ[dependencies.VARIABLE] = _NONE if library.problem else library.path
    try:
        with silenced() if library.problem else nullcontext():
            yield
    finally:
        if library.problem:
            os.environ.pop(dependencies.VARIABLE)
            if before is not None:
                os.environ[dependencies.VARIABLE] = before


LIBRARY = _loaded()
"""The libLLVM that was named to Dr.Jit, or why there is none."""
