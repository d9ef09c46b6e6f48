"""Makes the library's contact sheets for the manual: python docs/make_library.py [NAME ...]"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from sumo3dviz_pt.sheets import SheetOrder, draw_sheet, sheet_names

HERE = Path(__file__).resolve().parent
SIZE = (360, 240)
SMOOTH = ("skies",)
QUALITIES = {"skies": "standard"}
SIZES = {"skies": (392, 220), "levels": (340, 210)}


def make(name: str, folder: Path) -> None:
    """Draw a sheet and store it in few colours, to keep the repository small."""
    from PIL import Image

    raw = folder / f"{name}.png"
    draw_sheet(SheetOrder(name, raw, SIZES.get(name, SIZE), QUALITIES.get(name, "preview")))
    with Image.open(raw) as picture:
        small = picture.convert("RGB")
        if name not in SMOOTH:
            few = small.quantize(256, kmeans=2)  # dithers only towards a given palette
            small = small.quantize(palette=few, dither=Image.Dither.FLOYDSTEINBERG)
        small.save(HERE / "images" / f"sheet_{name}.png", optimize=True)


def main() -> int:
    """Draw the named sheets, or all."""
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or sheet_names():
            make(name, Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
