"""Makes the gallery's and the README's pictures: python docs/make_gallery.py [NAME ...]

Every picture is one call of the command line, and the manual shows that call.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
IMAGES = HERE / "images"
MADE = "<!-- Made by docs/make_gallery.py; change the script, not this page. -->"

COMMON = "--quality preview --size 960x540"

PICTURES = {
    "motorway_day": f"ronda --time 462 --camera driver {COMMON}",
    "motorway_golden_hour": "ronda --time 462 --camera driver"
    f" --set template=highway_golden_hour {COMMON}",
    "city_day": f"crossing --time 458 --camera corner --set template=city_day {COMMON}",
    "city_dusk": f"crossing --time 458 --camera corner --set template=city_dusk {COMMON}",
    "city_night": f"crossing --time 458 --camera corner --set template=city_night {COMMON}",
    "ronda_overview": f"ronda --time 488 --camera overview {COMMON}",
    "ronda_flight": f"ronda --time 458 --camera flight {COMMON}",
    "crossing_driver": f"crossing --time 497 --camera driver --set template=village_day {COMMON}",
    "overcast": f"crossing --time 458 --camera corner --set template=overcast {COMMON}",
    "ronda_abstract": f"ronda --time 488 --camera overview --set template=abstract {COMMON}",
}
"""Example and options by the picture's name."""


def command(name: str) -> list[str]:
    """The arguments of a picture's command, but for its output."""
    example, *options = PICTURES[name].split()
    return ["still", f"examples/{example}/scene.yaml", *options]


def page() -> str:
    """The gallery: every picture above the command that made it."""
    lines = [MADE, "", "# Gallery", ""]
    for name in PICTURES:
        lines += [
            f"![{name.replace('_', ', ')}](images/{name}.png)",
            "",
            "```sh",
            f"sumo3dviz-pt {' '.join(command(name))} -o {name}.png",
            "```",
            "",
        ]
    return "\n".join(lines)


def make(name: str, folder: Path) -> None:
    """Render a picture and store it in few colours, to keep the repository small."""
    from PIL import Image

    raw = folder / f"{name}.png"
    call = [sys.executable, "-m", "sumo3dviz_pt.cli", *command(name), "-o", str(raw)]
    subprocess.run(call, check=True, cwd=HERE.parent)
    with Image.open(raw) as picture:
        small = picture.convert("RGB").quantize(256, dither=Image.Dither.FLOYDSTEINBERG)
        small.save(IMAGES / f"{name}.png", optimize=True)


def main() -> int:
    """Render the named pictures, or all, and write the page."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or PICTURES:
            make(name, Path(folder))
    (HERE / "gallery.md").write_text(page(), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
