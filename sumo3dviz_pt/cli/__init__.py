"""The command line: it reads arguments, and writes pictures or one clear sentence.

One module for each command, or for a few that belong together, with `add` (what it takes) and
`run` (what it does).

Exit codes: 0 done; 2 wrong input or configuration; 1 failed while working, finished
frames are kept, or something is not installed; 130 interrupted; 141 the reader of the output
has gone. `compare` gives 1 where something differs, as `diff` does.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import argparse


__all__ = ["build_parser", "main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return the exit code."""
    try:
        # Ctrl-C may also come while our own modules are imported.
        from sumo3dviz_pt.cli.program import run

        try:
            return run(arguments)
        finally:
            print(end="", flush=True)
    except KeyboardInterrupt:
        print("sumo3dviz-pt: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        return _unread()


def build_parser() -> argparse.ArgumentParser:
    """Return all commands and their options."""
    from sumo3dviz_pt.cli.program import build_parser

    return build_parser()


def _unread() -> int:
    """End without a word, as tools do whose reader has gone: `sumo3dviz-pt check ... | head -1`."""
    import os

    # Python tries to write what is left when it ends, and would complain.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 141
