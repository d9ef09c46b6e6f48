"""`python -m sumo3dviz_pt.cli`: the same as `sumo3dviz-pt`."""

from __future__ import annotations

import sys

from sumo3dviz_pt.cli import main

if __name__ == "__main__":
    sys.exit(main())
