"""Silences libraries whose messages we say in words of our own, or listens to them."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def silenced() -> Iterator[None]:
    """Let nothing through to the console's standard error; libraries write past `sys.stderr`."""
    try:
        stderr = os.dup(2)
    except OSError:  # a program without a console has none
        yield
        return
    try:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
            yield
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)


@contextmanager
def overheard(output: list[bytes]) -> Iterator[None]:
    """Collect what comes to the console's standard error, and pass it on at the end.

    Args:
        output: Is told it.
    """
    try:
        stderr = os.dup(2)
    except OSError:  # a program without a console has none
        yield
        return
    with tempfile.TemporaryFile() as heard:
        try:
            os.dup2(heard.fileno(), 2)
            yield
        finally:
            os.dup2(stderr, 2)
            heard.seek(0)
            output.append(heard.read())
            with os.fdopen(stderr, "wb") as console:
                console.write(output[-1])


@contextmanager
def unwarned() -> Iterator[None]:
    """Let a library's warnings of a user's file go; what matters of them we say ourselves."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
