"""Makes the library's contact sheets for the manual: python tools/make_library.py [NAME ...]"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from sumo3dviz_pt.inspection.catalogue import SheetOrder, draw_sheet, sheet_names

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
SIZE = (360, 240)
SIZES = {"skies": (392, 220), "levels": (340, 210)}
QUALITIES = {"skies": "standard", "trees": "standard"}


def make(name: str, folder: Path) -> None:
    """Draw a sheet and store it with little loss, to keep the repository small."""
    from PIL import Image

    raw = folder / f"{name}.png"
    draw_sheet(SheetOrder(name, raw, SIZES.get(name, SIZE), QUALITIES.get(name, "preview")))
    with Image.open(raw) as picture:
        # Few colours put a weave on paint and cloth.
        target = IMAGES / f"sheet_{name}.jpg"
        picture.convert("RGB").save(target, quality=92, subsampling=0)


def main() -> int:
    """Draw the named sheets, or all."""
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or sheet_names():
            make(name, Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
