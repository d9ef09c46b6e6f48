"""Makes the pictures of gallery, templates and README: python tools/make_gallery.py [NAME ...]

Every picture is one call of the command line, and the manual shows that call.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from sumo3dviz_pt import catalog

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
IMAGES = DOCS / "images"
MADE = "<!-- Made by tools/make_gallery.py; change the script, not this page. -->"

BEAUTY = "--quality study --size 1280x720"
COMMON = "--quality preview --size 960x540"
SCENARIOS = ROOT.parent / "shared" / "data"
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

LOOK = "template_"
"""What names of scene templates' pictures begin with."""

LOOKS = {
    f"{LOOK}{name}": "crossing --time 458 --camera corner"
    f" --set template={name} --quality preview --size 480x270"
    for name in catalog.template_names("scene")
}
"""Every scene template over one place at one moment."""

ALL = {**PICTURES, **LOOKS}

CHOOSE = """\
A **template** is a whole look by one word: sky, light, ground, lamps and tone curve. A scene file
names one:

```yaml
template: city_dusk
```

and `--set template=city_dusk` tries one without changing the file. Whatever else the scene file
says wins over its template, key by key; only a `sky` replaces the template's as a whole. To change
the sky alone, name one of the presets below:

```yaml
template: city_day
sky: {preset: sky_golden}
```

The pictures show one place at one moment, with the preset `preview`. Which roads, houses and trees
there are comes from the simulation, so `highway_day` is not only for highways. A file of your own
in `scene_templates/scene` or `scene_templates/sky` of a checkout is a template or a preset like
these.
"""

SKIES = """\
## Skies

Each over the same road, house, car and tree, beside the sun or moon; nights are exposed for what
their sky alone lights, streets with lamps are not. The sun of each can be moved,
[by date and clock](howto/sun_by_date.md) or by angles; its clouds turn with it. A
[radiance map of your own](howto/own_models.md) may stand instead.

![Twelve skies](images/sheet_skies.jpg)

| preset | what | sun: azimuth, elevation |
|---|---|---|"""


def tell_tale(name: str) -> str:
    """Example and options of a close picture."""
    position, aim, fov = TELL_TALES[name]
    camera = f"{{mode: eulerian, position: {position}, look_at: {aim}, lens: {{fov: {fov}}}}}"
    return f"{CITY} --set 'cameras.near={camera}' {SMALL}"


def command(name: str) -> list[str]:
    """The arguments of a picture's command, but for its output."""
    example, *options = shlex.split(ALL[name] if name in ALL else tell_tale(name))
    scene = f"{example}.yaml" if name in FOREIGN else f"examples/{example}/scene.yaml"
    return ["still", scene, *options]


def page() -> str:
    """The gallery: every picture above the command that made it."""
    lines = [MADE, "", "# Gallery", "", *entries(PICTURES), "## Tell-tales", ""]
    lines += [
        "What once gave such pictures away, near by; [looks](internals/looks.md) say more.",
        "",
    ]
    return "\n".join([*lines, *entries(TELL_TALES)])


def templates_page() -> str:
    """All looks that a scene file can ask for by one word."""
    lines = [MADE, "", "# Templates and skies", "", CHOOSE]
    for picture in LOOKS:
        name = picture.removeprefix(LOOK)
        about, *content = source("scene", name)
        lines += [f"## {name}", "", about.removeprefix("# "), ""]
        lines += [*shown(picture, alt=name), "```yaml", *content, "```", ""]
    lines += [SKIES, *map(sky_row, catalog.template_names("sky")), ""]
    return "\n".join(lines)


def source(kind: str, name: str) -> list[str]:
    """Lines of a template's file; the first says what it is."""
    file = catalog.data_root("scene_templates") / kind / f"{name}.yaml"
    return file.read_text(encoding="utf-8").splitlines()


def sky_row(name: str) -> str:
    """A sky's row in the table."""
    sky = catalog.template("sky", name)
    sun = sky.get("sun") or catalog.find("skies", sky["clouds"]).meta["sun"]
    return f"| `{name}` | {sky['purpose']} | {sun['azimuth']:g}°, {sun['elevation']:g}° |"


def entries(names: Iterable[str]) -> list[str]:
    """Lines of some pictures."""
    lines = []
    for name in names:
        lines += shown(name, alt=name.replace("_", " "))
    return lines


def shown(name: str, *, alt: str) -> list[str]:
    """Lines of one picture: above the command that made it."""
    return [
        f"![{alt}](images/{name}.jpg)",
        "",
        "```sh",
        *([f"sumo3dviz-pt init {name} -o {name}.yaml"] if name in FOREIGN else []),
        f"sumo3dviz-pt {shlex.join(command(name))} -o {name}.png",
        "```",
        "",
    ]


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
    subprocess.run([sys.executable, "-m", "sumo3dviz_pt.cli", *words], check=True, cwd=ROOT)


PAGES = {"gallery.md": page, "templates.md": templates_page}


def main() -> int:
    """Render the named pictures, or all, and write the pages."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or (*ALL, *TELL_TALES):
            make(name, Path(folder))
    for name, text in PAGES.items():
        (DOCS / name).write_text(text(), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
