"""`doctor`: says what this machine has and lacks, and installs what is missing."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.errors import ConfigError, InstallationError

if TYPE_CHECKING:
    from sumo3dviz_pt.installation.packages import InstallOrder
    from sumo3dviz_pt.pipeline.doctor import Diagnosis


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser(
        "doctor", help="what is installed here, what is missing, and how to get it"
    )
    sub.add_argument(
        "--install", action="store_true", help="install the shared libraries that are missing"
    )
    sub.add_argument("--yes", action="store_true", help="do not ask before installing")
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Look at the installation, and mend it with --install; 0 if rendering works, even slowly."""
    from sumo3dviz_pt.pipeline.doctor import examine

    if options.yes and not options.install:
        raise ConfigError("goes with --install", key="--yes")
    found = examine()
    if options.install and _mended(found, yes=options.yes):
        found = examine()
    print("\n".join(found.lines))
    return 0 if found.healthy else 1


def _mended(found: Diagnosis, *, yes: bool) -> bool:
    """Install what is lacking; return whether anything was tried."""
    from sumo3dviz_pt.installation.packages import carry_out, order_for

    if not found.lacks:
        return False
    _tell(f"missing: {' and '.join(found.lacks)}")
    interactive = sys.stdin is not None and sys.stdin.isatty()
    try:
        order = order_for(found.lacks, interactive=interactive)
        if not (yes or _agreed(order)):
            return False
        carry_out(order, tell=_tell)
    except InstallationError as error:
        _tell(f"not everything was installed: {error}")
    return True


def _agreed(order: InstallOrder) -> bool:
    """Return whether the user agrees; say in any case what would be done."""
    if not order.interactive:
        _tell(f"nobody is there to ask; with --yes this would run: {order.in_words()}")
        return False
    try:
        answer = input(f"install by: {order.in_words()} [Y/n] ")
    except EOFError:
        return False
    return answer.strip().lower() in ("", "y", "yes")


def _tell(line: str) -> None:
    """Show a line before what the package manager prints next."""
    print(line, flush=True)
