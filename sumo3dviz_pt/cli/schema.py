"""`schema`: what editors need to know of scene files."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser(
        "schema", help="the scene file as JSON schema, for editors that complete and check"
    )
    sub.add_argument("-o", "--output", type=Path, help="file; else it is printed")


def run(options: argparse.Namespace) -> int:
    """Print or write the schema."""
    from sumo3dviz_pt.pipeline.schema import LINE, schema_text, write_schema

    if options.output is None:
        print(schema_text(), end="")
        return 0
    write_schema(options.output)
    line = LINE.rpartition("=")[0]
    print(f"wrote {options.output}; editors find it by this line: {line}={options.output.name}")
    return 0
