"""What tests need beside the package: who lacks it skips them, and CI fails."""

from __future__ import annotations

import importlib
import os
from types import ModuleType
from typing import NoReturn

import pytest

COMPLETE = bool(os.environ.get("SUMO3DVIZ_PT_TESTS_COMPLETE"))
"""Whether everything has to be there, as in CI: what is missing is a failure then."""


def lacking(why: str) -> NoReturn:
    """Skip a test, or all of the file that is being read; fail where everything has to be there."""
    if COMPLETE:
        pytest.fail(f"CI needs it: {why}", pytrace=False)
    pytest.skip(why, allow_module_level=True)


def package(name: str, why: str = "") -> ModuleType:
    """Import a package of an extra."""
    try:
        return importlib.import_module(name)
    except ImportError:
        lacking(why or f"{name} is not installed")


def skip_if(missing: bool, why: str) -> pytest.MarkDecorator:
    """Return a mark; where everything has to be there, the test runs and fails by itself."""
    return pytest.mark.skipif(missing and not COMPLETE, reason=why)
