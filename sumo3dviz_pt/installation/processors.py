"""How many threads this program may use."""

from __future__ import annotations

import os

THREADS = "SUMO3DVIZ_PT_THREADS"
"""Environment variable with the number of threads to use; workers of a farm set it."""


def threads_asked() -> int | None:
    """Return the threads that the environment asks for; None where it asks for none."""
    asked = os.environ.get(THREADS, "")
    return int(asked) if asked.isdecimal() and 0 < int(asked) <= 4096 else None


def threads() -> int:
    """Return the threads that this process may use."""
    asked = threads_asked()
    if asked is not None:
        return asked
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
