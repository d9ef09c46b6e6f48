"""Shows how far work is, and prints errors."""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING

from sumo3dviz_pt.cli.options import PROGRAM

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.progress.build import WorkStep


def complain(error: object, code: int, hint: str = "") -> int:
    """Print an error as one sentence; return the exit code.

    Args:
        error: What went wrong.
        code: The exit code.
        hint: What to do, added to the sentence.
    """
    print(f"{PROGRAM}: {error}{hint}", file=sys.stderr)
    return code


def progress(name: str, steps: Sequence[WorkStep]) -> AbstractContextManager[None]:
    """Show how far the work within the `with` statement is, unless the command is quiet."""
    from sumo3dviz_pt.pipeline.progress.build import followed

    if not logging.getLogger("sumo3dviz_pt").isEnabledFor(logging.WARNING):
        return nullcontext()
    return followed(name, steps)


def cpu_in_words(seconds: float) -> str:
    """Return CPU-seconds in words."""
    return f"{seconds:.1f} CPU-seconds"
