"""`compare`: says what differs between two pictures or films, by the accounts stored in them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("compare", help="say what two pictures or films were made from")
    of = "film.json, film.mp4, folder of frames, .exr or .png"
    sub.add_argument("one", type=Path, help=of)
    sub.add_argument("other", type=Path, help="what to compare it with, one of the same")
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Say what differs; 1 if something does, as `diff` does."""
    from sumo3dviz_pt.pipeline.accounts.differences import differences
    from sumo3dviz_pt.pipeline.films.frames import account_in

    one, other = account_in(options.one), account_in(options.other)
    found = differences(one, other)
    print("\n".join(found or ["nothing differs"]))
    if one.get("command") != other.get("command"):
        print(f"commands: {one.get('command') or '-'}\n          {other.get('command') or '-'}")
    return 1 if found else 0
