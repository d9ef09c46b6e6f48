"""Makes the small pictures of the manual.

    python tools/make_howto_pictures.py [-o FOLDER] [NAME ...]

Every picture is made of stills of the examples, side by side; its page says what differs between
them. `heights` and `land_cover` are made from networks of a few lines and need SUMO's netconvert
and sumo (the extra `sumo`). No picture has more than 60 kB.
"""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sumo3dviz_pt as sv
from sumo3dviz_pt import cli

if TYPE_CHECKING:
    from PIL.Image import Image

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
MOST_BYTES = 60_000
"""Of a picture."""

WIDTH = 640
"""Of a picture [pixels]."""

QUALITY = "preview"
HALF = (320, 180)
WHOLE = (640, 360)


# One still and many ----------------------------------------------------------------------


def still(
    scene: Path | str,
    changes: Mapping[str, Any] | None = None,
    *,
    time: float,
    camera: str,
    size: tuple[int, int] = HALF,
    quality: str = QUALITY,
) -> Image:
    """One picture of a scene file or of an example."""
    from PIL import Image

    path = scene if isinstance(scene, Path) else sv.example(scene)
    with sv.load(path, overrides=dict(changes or {})) as loaded:
        seen = loaded.still(time=time, camera=camera, quality=quality, size=size)
    return Image.fromarray(seen.develop())


def sheet(pictures: Sequence[tuple[str, Image]], *, columns: int) -> Image:
    """Put pictures of one size side by side, row by row, each with its words in a corner."""
    from PIL import Image, ImageDraw, ImageFont

    width, height = pictures[0][1].size
    rows = -(-len(pictures) // columns)
    paper = Image.new("RGB", (columns * width, rows * height))
    pen, font = ImageDraw.Draw(paper), ImageFont.load_default(13)
    for number, (words, picture) in enumerate(pictures):
        row, column = divmod(number, columns)
        corner = (column * width, row * height)
        paper.paste(picture, corner)
        place = (corner[0] + 6, corner[1] + 4)
        pen.text(place, words, "white", font, stroke_width=2, stroke_fill="black")
    return paper


def crop(picture: Image, *, at: tuple[int, int], size: tuple[int, int]) -> Image:
    """A part of a picture from its upper left corner, as it is."""
    return picture.crop((*at, at[0] + size[0], at[1] + size[1]))


def jpeg(picture: Image) -> bytes:
    """A picture as a JPEG, as good as its bytes allow."""
    assert picture.width <= WIDTH
    for quality in range(90, 20, -4):
        stream = io.BytesIO()
        picture.save(stream, "JPEG", quality=quality, optimize=True)
        if stream.tell() <= MOST_BYTES:
            return stream.getvalue()
    raise ValueError(f"a picture of {picture.size} does not fit {MOST_BYTES} bytes")


# Pictures of the examples ----------------------------------------------------------------


def first_film() -> Image:
    """What `init` proposes for the crossing: four of its cameras."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "city.yaml"
        config = sv.example("crossing").with_name("crossing.sumocfg")
        with suppress(SystemExit):
            cli.main(["init", str(config), "-o", str(scene)])
        with sv.load(scene) as loaded:
            starts = {shot.camera: shot.start for shot in loaded.job.shots}
        names = ("overview", "corner", "driver", "flight")
        seen = [(name, still(scene, time=starts[name] + 2.0, camera=name)) for name in names]
    return sheet(seen, columns=2)


def colours_by_id() -> Image:
    """The same moment as chance has it, and with a taxi and a red car by their ids."""
    chosen = {
        "vehicles": {
            "by_id": {
                "traffic_E_S.14": {"model": "taxi"},
                "traffic_W_E.54": {"model": "suv", "colour": "#c8102e"},
            }
        }
    }
    near = {"cameras": {"near": NEAR}}
    seen = [
        (words, still("crossing", {**near, **more}, time=458.0, camera="near"))
        for words, more in (("by chance", {}), ("by id", chosen))
    ]
    return sheet(seen, columns=2)


NEAR = {
    "mode": "eulerian",
    "position": [326, 286, 5.5],
    "look_at": [309, 297.5, 0],
    "lens": {"fov": 45},
}


def sun_by_date() -> Image:
    """The hours of a day in Berlin's summer."""
    seen = []
    for hour in ("06:00", "13:00", "19:30", "21:45"):
        sun = {"date": "2026-06-21", "time": hour, "place": [52.52, 13.405]}
        sky = {"sky": {"preset": "sky_daycloud1", "sun": sun}}
        seen.append((hour, still("crossing", sky, time=458.0, camera="corner")))
    return sheet(seen, columns=2)


def slow_motion() -> Image:
    """Three moments of a film at full speed, and the same moments at a quarter of it."""
    seen = [
        (
            f"speed {speed:g}, {film:g} s of film",
            still("ronda", RONDA, time=488.0 + film * speed, camera="near", size=(212, 159)),
        )
        for speed in (1.0, 0.25)
        for film in (0.0, 0.5, 1.0)
    ]
    return sheet(seen, columns=3)


RONDA = {
    "cameras": {
        "near": {
            "mode": "eulerian",
            "position": [1207.1, 798.3, 11],
            "look_at": [1150, 779, 0],
            "lens": {"fov": 40},
        }
    }
}


def rain_fog_snow() -> Image:
    """Four weathers at one corner."""
    seen = [
        (words, still("crossing", {"weather": weather}, time=458.0, camera="corner"))
        for words, weather in (
            ("rain: {rate: 10 mm/h}", {"rain": {"rate": "10 mm/h"}}),
            ("fog: {visibility: 200 m}", {"fog": {"visibility": "200 m"}}),
            ("snow: {depth: 3 cm}", {"snow": {"depth": "3 cm"}}),
            ("season: autumn", {"season": "autumn"}),
        )
    ]
    return sheet(seen, columns=2)


def weather_falling() -> Image:
    """What falls: streaks as they are drawn and as strong as in a photograph, flakes, a pane."""
    rain = {"rate": "20 mm/h"}
    wind = {"speed": "3 m/s", "from": 270}
    many = [
        ("rain, streaks: 6 (as drawn)", {"rain": rain, "wind": wind}, "corner"),
        ("rain, streaks: 1 (physical)", {"rain": {**rain, "streaks": 1}, "wind": wind}, "corner"),
        ("snow: {falling: 2 mm/h}", {"snow": {"depth": "2 cm", "falling": "2 mm/h"}}, "corner"),
        ("downpour, from a car", {"preset": "downpour"}, "driver"),
    ]
    seen = [
        (words, still("crossing", {"weather": weather}, time=495.0, camera=camera))
        for words, weather, camera in many
    ]
    return sheet(seen, columns=2)


def blur() -> Image:
    """The roadside from a car without a shutter and with one; dusk at two exposures."""
    aside = {"mode": "lagrangian", "vehicle": "e_joining.46", "view": "hood", "heading": 50}
    shutter = {"angle": 180, "moments": 16}
    # Frames as long as a GIF's.
    both = {"sharp": aside, "blurred": {**aside, "shutter": shutter}}
    ride = {"output": {"fps": 12.5}, "cameras": both}
    seen = [
        ("no shutter", still("ronda", ride, time=466.2, camera="sharp")),
        ("shutter: {angle: 180}", still("ronda", ride, time=466.2, camera="blurred")),
    ]
    for exposure in (0, 2):
        dusk = {"template": "city_dusk", "output": {"exposure": exposure}}
        words = f"dusk, output.exposure: {exposure}"
        seen.append((words, still("crossing", dusk, time=458.0, camera="corner")))
    return sheet(seen, columns=2)


def all_around() -> Image:
    """Everything around a place in the middle of the crossing."""
    camera = {
        "mode": "eulerian",
        "position": [291, 283, 2.2],
        "heading": 30,
        "lens": {"projection": "equirectangular"},
    }
    cameras = {"cameras": {"around": camera}}
    return still("crossing", cameras, time=458.0, camera="around", size=(640, 320))


def signals() -> Image:
    """One approach in the styles of three countries."""
    camera = {
        "mode": "eulerian",
        "position": [275, 295.5, 2.0],
        "look_at": [287, 292.8, 2.4],
        "lens": {"fov": 45},
    }
    seen = [
        (
            style,
            still(
                "crossing",
                {"cameras": {"stop": camera}, "roads": {"marking_style": style}},
                time=470.0,
                camera="stop",
                size=(212, 212),
            ),
        )
        for style in ("european", "american", "british")
    ]
    return sheet(seen, columns=3)


def quality() -> Image:
    """One crop of a still in each preset, at dusk."""
    from PIL import Image

    seen = []
    for preset in ("draft", "preview", "standard", "study"):
        picture = still(
            "crossing",
            {"template": "city_dusk"},
            time=458.0,
            camera="corner",
            size=(384, 216),
            quality=preset,
        )
        part = crop(picture, at=(150, 78), size=(80, 80))
        seen.append((preset, part.resize((160, 160), Image.Resampling.NEAREST)))
    return sheet(seen, columns=4)


# Pictures of networks of our own ---------------------------------------------------------

CAR = (
    '<vType id="car" vClass="passenger"/><vType id="lorry" vClass="truck"/>'
    '<vType id="bus" vClass="bus"/>'
)


def simulated(
    folder: Path, *, nodes: str, edges: str, routes: str, additional: str = ""
) -> dict[str, Any]:
    """Let SUMO make a network and drive on it; the keys of a scenario that say where all lies."""
    for name, root, text in (
        ("a.nod.xml", "nodes", nodes),
        ("a.edg.xml", "edges", edges),
        ("a.rou.xml", "routes", CAR + routes),
        ("a.add.xml", "additional", additional),
    ):
        (folder / name).write_text(f"<{root}>{text}</{root}>\n", encoding="utf-8")
    net = (
        "netconvert",
        "-n",
        "a.nod.xml",
        "-e",
        "a.edg.xml",
        "-o",
        "a.net.xml",
        "--no-turnarounds",
    )
    run = ("sumo", "-n", "a.net.xml", "-r", "a.rou.xml", "--end", "60", "--fcd-output", "fcd.xml")
    for words in ((*net, "--offset.disable-normalization"), (*run, "--no-step-log")):
        subprocess.run(words, cwd=folder, check=True, capture_output=True)
    return {
        "network": "a.net.xml",
        "trajectories": ["fcd.xml"],
        "vehicle_types": ["a.rou.xml"],
        "additional": ["a.add.xml"] if additional else [],
    }


def flows(*routes: tuple[str, str, int]) -> str:
    """Traffic: name, edges, and seconds between two vehicles of each route."""
    kinds = ("car", "car", "lorry", "car", "bus")
    return "".join(
        f'<vehicle id="{name}.{n}" type="{kinds[n % len(kinds)]}" depart="{n * gap}" '
        f'departSpeed="max"><route edges="{edges}"/></vehicle>'
        for n in range(60)
        for name, edges, gap in routes
        if n * gap < 60
    )


def of_network(text: Mapping[str, str], camera: Mapping[str, Any], *, time: float) -> Image:
    """A still of a network of a few lines."""
    import yaml

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = {
            "template": "village_day",
            "scenario": simulated(folder, **text),
            "cameras": {"eye": dict(camera)},
            "shots": [{"camera": "eye", "from": time, "to": time + 1.0}],
        }
        (folder / "scene.yaml").write_text(yaml.safe_dump(scene), encoding="utf-8")
        return still(folder / "scene.yaml", time=time, camera="eye", size=WHOLE)


def road(name: str, *nodes: str, lanes: int = 2, speed: float = 14.0) -> str:
    """Edges in both directions from node to node."""
    text = ""
    for one, other in pairwise(nodes):
        for a, b in ((one, other), (other, one)):
            text += (
                f'<edge id="{name}_{a}_{b}" from="{a}" to="{b}" numLanes="{lanes}"'
                f' speed="{speed}"/>'
            )
    return text


def heights() -> Image:
    """A road that climbs over another one: ramps of earth, a bridge, columns."""
    nodes = (
        '<node id="w" x="-160" y="0" z="0"/><node id="e" x="160" y="0" z="0"/>'
        '<node id="s" x="-20" y="-190" z="0"/><node id="s1" x="-10" y="-100" z="1"/>'
        '<node id="b0" x="-4" y="-40" z="6.5"/><node id="b1" x="4" y="40" z="6.5"/>'
        '<node id="n1" x="10" y="100" z="1"/><node id="n" x="20" y="190" z="0"/>'
    )
    over = ("s", "s1", "b0", "b1", "n1", "n")
    edges = road("low", "w", "e") + road("high", *over, lanes=1)
    up = " ".join(f"high_{a}_{b}" for a, b in pairwise(over))
    routes = flows(("a", "low_w_e", 4), ("b", "low_e_w", 5), ("c", up, 7))
    camera = {
        "mode": "eulerian",
        "position": [-62, -38, 9],
        "look_at": [4, 6, 2],
        "lens": {"fov": 55},
    }
    return of_network({"nodes": nodes, "edges": edges, "routes": routes}, camera, time=40.0)


def land_cover() -> Image:
    """A road among a pond, a wood, a field, a car park, a pitch and a vineyard."""
    nodes = '<node id="w" x="-180" y="0"/><node id="m" x="0" y="0"/><node id="e" x="180" y="0"/>'
    edges = road("road", "w", "m", "e", lanes=1)
    routes = flows(("a", "road_w_m road_m_e", 6), ("b", "road_e_m road_m_w", 7))
    covers = {
        "natural.water": "-15,14 12,10 26,20 28,38 8,46 -14,38 -24,26",
        "landuse.forest": "40,12 120,12 120,80 44,80",
        "landuse.farmland": "-40,12 -110,12 -110,90 -40,90",
        "amenity.parking": "-50,-10 -12,-10 -12,-42 -50,-42",
        "leisure.pitch": "2,-12 62,-12 62,-50 2,-50",
        "landuse.vineyard": "-20,54 34,54 34,96 -20,96",
    }
    additional = "".join(
        f'<poly id="p{n}" type="{kind}" color="0,200,0" fill="1" layer="-1" shape="{shape}"/>'
        for n, (kind, shape) in enumerate(covers.items())
    )
    camera = {
        "mode": "eulerian",
        "position": [-14, -92, 46],
        "look_at": [0, 8, 0],
        "lens": {"fov": 62},
    }
    text = {"nodes": nodes, "edges": edges, "routes": routes, "additional": additional}
    return of_network(text, camera, time=30.0)


# ------------------------------------------------------------------------------------------

PICTURES: dict[str, Callable[[], Image]] = {
    make.__name__: make
    for make in (
        first_film, colours_by_id, sun_by_date, slow_motion, rain_fog_snow, weather_falling, blur,
        all_around, signals, quality, heights, land_cover,
    )
}  # fmt: skip


def main() -> int:
    """Make the pictures that are asked for, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(PICTURES)}")
    parser.add_argument("-o", dest="folder", type=Path, default=IMAGES, help="where they are put")
    asked = parser.parse_args()
    for name in asked.names or PICTURES:
        content = jpeg(PICTURES[name]())
        (asked.folder / f"howto_{name}.jpg").write_bytes(content)
        print(f"{name}: {len(content)} bytes", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
