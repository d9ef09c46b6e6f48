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

BEAUTY = "--quality study --size 1280x720"
COMMON = "--quality preview --size 960x540"
SCENARIOS = HERE.parents[1] / "shared" / "data"
"""Scenarios that are not ours to ship; pictures of them are made where they are there."""

PAPER = (
    "{mode: eulerian, position: [19357.74, 17808.70, 11.95], look_at: [19265, 17773, 0],"
    " lens: {fov: 60}}"
)
"""The founding paper's standing camera, turned along the road."""

PICTURES = {
    "motorway_day": f"ronda --time 462 --camera driver {BEAUTY}",
    "motorway_golden_hour": "ronda --time 462 --camera driver"
    f" --set template=highway_golden_hour {BEAUTY}",
    "city_day": f"crossing --time 458 --camera corner --set template=city_day {BEAUTY}",
    "city_dusk": f"crossing --time 458 --camera corner --set template=city_dusk {BEAUTY}",
    "city_night": f"crossing --time 458 --camera corner --set template=city_night {BEAUTY}",
    "barcelona": f"barcelona --time 1260 --camera paper --set 'cameras.paper={PAPER}' {BEAUTY}",
    "ronda_overview": f"ronda --time 488 --camera overview {COMMON}",
    "ronda_flight": f"ronda --time 458 --camera flight {COMMON}",
    "crossing_driver": f"crossing --time 497 --camera driver --set template=village_day {COMMON}",
    "overcast": f"crossing --time 458 --camera corner --set template=overcast {COMMON}",
    "ronda_abstract": f"ronda --time 488 --camera overview --set template=abstract {COMMON}",
}
"""Example and options by the picture's name."""

FOREIGN = {"barcelona"}
"""Pictures of scenarios that `init` makes a scene file for."""

CITY = "crossing --time 458 --camera near --set template=city_day"
SMALL = "--quality standard --size 480x360"

TELL_TALES = {
    "lamps_and_tailgates": ("[323.2, 305.9, 1.5]", "[318.5, 305.2, 0.9]", 40),
    "rear_quarters": ("[324, 302.2, 1.6]", "[317.5, 305, 0.8]", 45),
    "faces": ("[316, 293.2, 1.5]", "[303, 295.6, 0.9]", 45),
    "paint": ("[303, 301.6, 1.4]", "[300.8, 297, 0.8]", 45),
    "leaves": ("[256, 279, 3]", "[285, 325, 8]", 55),
    "clouds": ("[328, 280, 7]", "[228, 330, 45]", 65),
    "asphalt": ("[287, 276, 5]", "[291, 296, 0]", 50),
    "fronts": ("[287, 304, 1.6]", "[275, 330, 5]", 50),
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
    scene = f"{example}.yaml" if name in FOREIGN else f"examples/{example}/scene.yaml"
    return ["still", scene, *options]


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
            f"![{name.replace('_', ', ')}](images/{name}.jpg)",
            "",
            "```sh",
            *([f"sumo3dviz-pt init {name} -o {name}.yaml"] if name in FOREIGN else []),
            f"sumo3dviz-pt {shlex.join(command(name))} -o {name}.png",
            "```",
            "",
        ]
    return lines


def make(name: str, folder: Path) -> None:
    """Render a picture and store it with little loss, to keep the repository small."""
    from PIL import Image

    raw = folder / f"{name}.png"
    words = command(name)
    if name in FOREIGN:
        words[1] = str(folder / words[1])
        call("init", str(SCENARIOS / name), "-o", words[1])
    call(*words, "-o", str(raw))
    with Image.open(raw) as picture:
        # Few colours would turn signals and blinkers into their neighbours' hue.
        picture.convert("RGB").save(IMAGES / f"{name}.jpg", quality=93, subsampling=0)


def call(*words: str) -> None:
    """Run our command line."""
    subprocess.run([sys.executable, "-m", "sumo3dviz_pt.cli", *words], check=True, cwd=HERE.parent)


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
