"""Makes files of `assets/` again, the same bytes every time: maps of surfaces and skies, bodies.

Run `python tools/bake.py` for all of them, a quarter of an hour, or name families and assets:
`python tools/bake.py skies surfaces/asphalt vehicles/sedan`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from bakers.skies.bake import bake_clouds
from bakers.surfaces.bake import bake_surface
from bakers.waves import bake_waves
from bakery.bake import bake_folder

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.inspection.catalogue import checked

Bake = Callable[[Path], tuple[Path, ...]]
"""Makes the files of an asset's folder again."""

BAKERS: Mapping[str, Bake] = {
    "surfaces": bake_surface,
    "skies": bake_clouds,
    "areas": bake_waves,
    "vehicles": bake_folder,
}
"""What makes the files of an asset, by family."""


def main() -> int:
    """Make what the command line names and say what is being made."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("chosen", nargs="*", default=list(BAKERS), help="families, or family/name")
    parser.add_argument("-o", "--output", type=Path, help="folder to build in; default in place")
    options = parser.parse_args()
    try:
        build(options.chosen, into=options.output)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def build(chosen: Sequence[str], *, into: Path | None = None) -> None:
    """Make the files of assets again; vehicles that are coupled from other assets have none.

    Args:
        chosen: Families, or `family/name`.
        into: A folder that gets a copy of the assets to build; None builds in place.

    Raises:
        ConfigError: If a family or an asset is unknown or has no files.
        OSError: If files cannot be written.
    """
    entries = [entry for entry in _entries(chosen) if "units" not in entry.meta]
    for entry in entries:
        if entry.family not in BAKERS:
            makes = ", ".join(BAKERS)
            raise ConfigError(f"{entry.family} have no files to be made, only {makes}")
    for number, entry in enumerate(entries, 1):
        folder = entry.folder
        if into is not None:
            folder = into / entry.family / entry.name
            for path in catalog.recipe_files(entry):
                _copied(path, into / entry.family / path.parent.name)
        print(f"{number} of {len(entries)}: {entry.family}/{entry.name}", flush=True)
        BAKERS[entry.family](folder)


def _copied(path: Path, folder: Path) -> None:
    """Copy what says what an asset is to where it is to be built."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / path.name).write_bytes(path.read_bytes())


def _entries(chosen: Sequence[str]) -> list[catalog.Entry]:
    """Return the assets that words mean."""
    found = []
    for word in chosen:
        family, _, name = word.partition("/")
        checked([family])
        names = [name] if name else catalog.names(family)
        found += [catalog.find(family, each) for each in names]
    return found


if __name__ == "__main__":
    sys.exit(main())
