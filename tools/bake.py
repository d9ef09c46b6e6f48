"""Makes the maps of surfaces, skies and water in `assets/` again, the same pixels every time.

Run `python tools/bake.py` for all of them, or name families and assets:
`python tools/bake.py skies surfaces/asphalt`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

from bakers.skies.bake import bake_clouds
from bakers.surfaces.bake import bake_surface
from bakers.waves import bake_waves

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.news import News, heard_by
from sumo3dviz_pt.pipeline.baking import Bake, build

BAKERS: Mapping[str, Bake] = {"surfaces": bake_surface, "skies": bake_clouds, "areas": bake_waves}
"""What makes the files of an asset, by family."""


def main() -> int:
    """Make what the command line names and say what is being made."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("chosen", nargs="*", default=list(BAKERS), help="families, or family/name")
    parser.add_argument("-o", "--output", type=Path, help="folder to build in; default in place")
    options = parser.parse_args()
    try:
        with heard_by(_say):
            build(options.chosen, into=options.output, bakers=BAKERS)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _say(news: News) -> None:
    """Print which asset comes next."""
    print(f"{news.done + 1} of {news.total}: {news.what}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
