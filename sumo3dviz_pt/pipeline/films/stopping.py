"""Lets a frame be finished before its process ends, so that no work is lost.

Clusters and service managers ask a process to end by SIGTERM (on Windows: Ctrl-Break) some time
before they kill it. A frame that is being rendered is finished first; else the work is broken
off at once. In both cases it ends as by Ctrl-C.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

WORKER = "SUMO3DVIZ_PT_WORKER"
"""Environment variable with the process that watches this one; it ends soon after that one."""

SIGNALS = [getattr(signal, name) for name in ("SIGTERM", "SIGBREAK") if hasattr(signal, name)]
"""Signals that ask a process to end; the last one is that which other processes can send here."""


@dataclass(slots=True)
class _Asked:
    """Whether the process was asked to end, and whether a frame is to be finished first."""

    asked: bool = False
    busy: bool = False


_ASKED: ContextVar[_Asked | None] = ContextVar("asked", default=None)


@contextmanager
def stoppable() -> Iterator[None]:
    """Finish a frame when the process is asked to end within the `with` statement.

    Raises:
        KeyboardInterrupt: After the frame, or at once where none is being rendered.
    """
    state = _Asked()

    def told(*_: object) -> None:
        state.asked = True
        if not state.busy:
            raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    before = {which: signal.signal(which, told) for which in SIGNALS if main}
    token = _ASKED.set(state)
    try:
        yield
    finally:
        _ASKED.reset(token)
        for which, handler in before.items():
            signal.signal(which, handler)


@contextmanager
def whole_frame() -> Iterator[None]:
    """Finish what is within the `with` statement before the process ends.

    Raises:
        KeyboardInterrupt: Afterwards, if the process was asked to end meanwhile.
    """
    state = _ASKED.get()
    if state is None:
        yield
        return
    state.busy = True
    try:
        yield
    finally:
        state.busy = False
    if state.asked or _left_alone():
        raise KeyboardInterrupt


def _left_alone() -> bool:
    """Return whether the worker that watched this process has died; never true on Windows."""
    worker = os.environ.get(WORKER, "")
    return worker.isdecimal() and os.getppid() != int(worker) and os.name == "posix"
