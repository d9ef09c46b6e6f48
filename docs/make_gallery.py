"""Makes the gallery's and the README's pictures: python docs/make_gallery.py [NAME ...]

Every picture is one call of the command line, and the manual shows that call.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterable
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

CITY = "crossing --time 458 --camera near --set template=city_day"
SMALL = "--quality standard --size 480x360"

TELL_TALES = {
    "lamps_and_tailgates": ("[323.2, 305.9, 1.5]", "[318.5, 305.2, 0.9]", 40),
    "rear_quarters": ("[324, 302.2, 1.6]", "[317.5, 305, 0.8]", 45),
    "faces": ("[316, 293.2, 1.5]", "[303, 295.6, 0.9]", 45),
    "paint": ("[303, 301.6, 1.4]", "[300.8, 297, 0.8]", 45),
    "leaves": ("[287, 304, 1.6]", "[275, 330, 5]", 50),
    "clouds": ("[328, 280, 7]", "[228, 330, 45]", 65),
    "asphalt": ("[287, 276, 5]", "[291, 296, 0]", 50),
    "fronts": ("[256, 279, 3]", "[285, 325, 8]", 55),
    "people": ("[287, 304.5, 1.6]", "[281.4, 308.3, 1]", 30),
}
"""Position, aim and angle of view of what once gave our pictures away, on the crossing."""


def tell_tale(name: str) -> str:
    """Example and options of a close picture."""
    position, aim, fov = TELL_TALES[name]
    camera = f"{{mode: eulerian, position: {position}, look_at: {aim}, lens: {{fov: {fov}}}}}"
    return f"{CITY} --set 'cameras.near={camera}' {SMALL}"


def command(name: str) -> list[str]:
    """The arguments of a picture's command, but for its output."""
    example, *options = shlex.split(PICTURES[name] if name in PICTURES else tell_tale(name))
    return ["still", f"examples/{example}/scene.yaml", *options]


def page() -> str:
    """The gallery: every picture above the command that made it."""
    lines = [MADE, "", "# Gallery", "", *entries(PICTURES), "## Tell-tales", ""]
    lines += ["What once gave such pictures away, near by; [library](library.md) says more.", ""]
    return "\n".join([*lines, *entries(TELL_TALES)])


def entries(names: Iterable[str]) -> list[str]:
    """Lines of some pictures."""
    lines = []
    for name in names:
        lines += [
            f"![{name.replace('_', ', ')}](images/{name}.png)",
            "",
            "```sh",
            f"sumo3dviz-pt {shlex.join(command(name))} -o {name}.png",
            "```",
            "",
        ]
    return lines


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
        for name in sys.argv[1:] or (*PICTURES, *TELL_TALES):
            make(name, Path(folder))
    (HERE / "gallery.md").write_text(page(), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
