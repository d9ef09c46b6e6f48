"""How far the work is, and what came out, in words."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sumo3dviz_pt.cli.options import PROGRAM


def complain(error: object, code: int, hint: str = "") -> int:
    """Print an error as one sentence; the exit code."""
    print(f"{PROGRAM}: {error}{hint}", file=sys.stderr)
    return code


@contextmanager
def progress() -> Iterator[Callable[..., None]]:
    """A line that says how far the work is and how long it will take."""
    import time

    live = sys.stderr.isatty()
    quiet = not logging.getLogger("sumo3dviz_pt").isEnabledFor(logging.WARNING)
    last = [0.0]

    def show(name: str, done: int, total: int, left: float = 0.0) -> None:
        now = time.monotonic()
        if quiet:
            return
        if not live and done < total and now - last[0] < 10:
            return
        last[0] = now
        minutes, seconds = divmod(round(left), 60)
        text = f"{name}: {done} of {total}, {minutes}:{seconds:02d} left"
        print(
            f"\r{text:<60}" if live else text, end="" if live else "\n", file=sys.stderr, flush=True
        )

    try:
        yield show
    finally:
        if live and last[0]:
            print(file=sys.stderr)


def cpu_in_words(cpu: dict[str, float]) -> str:
    """CPU-seconds in words."""
    return f"{sum(cpu.values()):.1f} CPU-seconds"
