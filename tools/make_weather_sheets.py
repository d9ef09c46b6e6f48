"""Makes the sheets of all weathers: python tools/make_weather_sheets.py [-o FOLDER] [PLACE ...]

Every picture of a sheet is a still of an example in a weather, by day, at dusk or by night. Names
are written on them. With -o the pictures are kept, one by one, at their full size.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import sumo3dviz_pt as sv
from sumo3dviz_pt import catalog

if TYPE_CHECKING:
    from PIL.Image import Image

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
SIZE = (640, 360)
SHOWN = (384, 216)
"""Width and height of a picture, rendered and on its sheet [pixels]."""

HOURS = {"day": "city_day", "dusk": "city_dusk", "night": "city_night"}
"""Templates by the columns of a sheet."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where pictures are taken.

    Attributes:
        example: Name of the example.
        camera: Of its cameras.
        time: Of the simulation [s].
    """

    example: str
    camera: str
    time: float


PLACES = {"ronda": Place("ronda", "driver", 462.0), "crossing": Place("crossing", "corner", 458.0)}


def pictures(place: Place, weathers: Iterable[str]) -> Iterator[tuple[str, Image]]:
    """Render all pictures of a sheet, row by row; yield each with its name."""
    from PIL import Image

    for weather in weathers:
        for hour, template in HOURS.items():
            chosen = {"weather": {"preset": weather}, "template": template}
            with sv.load(sv.example(place.example), overrides=chosen) as scene:
                still = scene.still(
                    time=place.time, camera=place.camera, quality="preview", size=SIZE
                )
            yield f"{weather}, {hour}", Image.fromarray(still.develop())


def sheet(named: Iterable[tuple[str, Image]], *, rows: int) -> Image:
    """Put pictures side by side, three in a row, each with its name in a corner."""
    from PIL import Image, ImageDraw, ImageFont

    width, height = SHOWN
    paper = Image.new("RGB", (len(HOURS) * width, rows * height))
    pen, font = ImageDraw.Draw(paper), ImageFont.load_default(14)
    for number, (name, picture) in enumerate(named):
        row, column = divmod(number, len(HOURS))
        corner = (column * width, row * height)
        paper.paste(picture.resize(SHOWN, Image.Resampling.LANCZOS), corner)
        pen.text((corner[0] + 8, corner[1] + 6), name, "white", font, stroke_width=2,
                 stroke_fill="black")  # fmt: skip
    return paper


def kept(named: Iterable[tuple[str, Image]], folder: Path | None) -> Iterator[tuple[str, Image]]:
    """Write pictures to a folder, if there is one, as they pass; say which is done."""
    for name, picture in named:
        print(name, flush=True)
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            picture.save(folder / f"{name.replace(', ', '_')}.png")
        yield name, picture


def main() -> int:
    """Make the sheets that are asked for, or both."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("places", nargs="*", metavar="PLACE", help=f"of {', '.join(PLACES)}")
    parser.add_argument("-o", dest="folder", type=Path, help="where single pictures are kept")
    asked = parser.parse_args()
    weathers = catalog.template_names("weather")
    for name in asked.places or PLACES:
        folder = asked.folder and asked.folder / name
        named = kept(pictures(PLACES[name], weathers), folder)
        made = sheet(named, rows=len(weathers))
        made.save(IMAGES / f"weather_sheet_{name}.jpg", quality=88)
    return 0


if __name__ == "__main__":
    sys.exit(main())
