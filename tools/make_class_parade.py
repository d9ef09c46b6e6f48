"""Makes a small SUMO log in which every class drives: python tools/make_class_parade.py FOLDER

Each vClass and guiShape has an edge of its own, all side by side, and drives along it. A bus
takes somebody aboard, a lorry a container. With `--sheet PICTURE.png` each road user is drawn as
films show it, on a grid of 1 m and beside a person; a .jpg is made small enough for the manual.
Needs SUMO's netconvert and sumo.
"""

from __future__ import annotations

import argparse
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import choose, looks_for, models_for
from sumo3dviz_pt.cast.colours import paint_of
from sumo3dviz_pt.inspection import catalogue
from sumo3dviz_pt.library.materials import MATERIALS, principled
from sumo3dviz_pt.library.mesh.solids import box
from sumo3dviz_pt.model.geometry import Colour, Mesh, Transform, merge_meshes
from sumo3dviz_pt.model.scene import Part, is_tinted
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.shot.showroom import Exhibit
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS, read_vehicle_types

LENGTH = 640.0
"""Of each edge [m]."""

START = 450.0
"""Where fronts are at first [m]; the longest train has 400 m."""

LONGEST = 52.0
"""Of a train in the picture, so that its cars can be told apart [m]."""

MOST_BYTES = 250_000
"""Of a picture that is a JPEG."""

SECONDS = 16
SPEED = 3.0  # of everyone [m/s]

SHAPES = {
    # guiShape: vClass, length, width, height [m]
    "passenger/sedan": ("passenger", 4.7, 1.8, 1.5),
    "passenger/hatchback": ("passenger", 4.2, 1.8, 1.5),
    "passenger/wagon": ("passenger", 4.8, 1.8, 1.5),
    "passenger/van": ("passenger", 4.8, 1.9, 1.9),
    "truck/semitrailer": ("truck", 16.5, 2.55, 4.0),
    "truck/trailer": ("truck", 18.75, 2.55, 4.0),
    "bus/city": ("bus", 12.0, 2.55, 3.1),
    "bus/overland": ("bus", 13.0, 2.55, 3.2),
    "bus/coach": ("bus", 14.0, 2.55, 3.8),
    "bus/flexible": ("bus", 18.0, 2.55, 3.1),
    "bus/trolley": ("bus", 12.0, 2.55, 3.2),
    "rail/light": ("tram", 33.0, 2.4, 3.4),
    "rail/city": ("rail_urban", 70.0, 2.9, 3.7),
    "rail/slow": ("rail", 130.0, 2.9, 3.9),
    "rail/fast": ("rail_fast", 200.0, 2.9, 3.9),
    "rail/railcar": ("rail", 55.0, 2.9, 3.9),
    "rail/cargo": ("rail", 180.0, 2.9, 3.9),
    "firebrigade": ("emergency", 8.4, 2.5, 3.3),
    "police": ("authority", 4.7, 1.8, 1.5),
    "rickshaw": ("taxi", 2.65, 1.3, 1.7),
    "aircraft": ("aircraft", 37.6, 35.8, 11.8),
}
"""Shapes beside those that a class has without more, those that SUMO reads of old files too."""

SIZES = {
    # Name: vClass, length, width, height [m]
    "light_aircraft": ("aircraft", 8.3, 11.0, 2.7),
    "boat": ("ship", 6.5, 2.3, 2.1),
    "ferry": ("ship", 46.0, 11.0, 11.4),
    "barge": ("ship", 64.0, 8.2, 6.4),
    "army_truck": ("army", 9.0, 2.5, 3.6),
    "locomotive": ("rail", 19.0, 2.9, 3.9),
}
"""Sizes beside those that a class has without more."""

_SHAPE = "_shape"  # ends the names of rows that a guiShape has

WALKERS = ("pedestrian", "wheelchair")
"""Classes of people."""


@dataclass(frozen=True, slots=True)
class Row:
    """An edge and who is on it.

    Attributes:
        name: Of edge, type and road user.
        vclass: SUMO's vClass.
        size: Length, width, height [m].
        attributes: Of the vType, beyond its id and vClass.
    """

    name: str
    vclass: str
    size: tuple[float, float, float]
    attributes: str = ""


def rows() -> Iterator[Row]:
    """Yield all classes as SUMO has them, then more shapes and sizes."""
    for vclass, own in CLASS_DEFAULTS.items():
        yield Row(vclass, vclass, (own.length, own.width, own.height))
    for shape, (vclass, *size) in SHAPES.items():
        yield _sized(shape.replace("/", "_") + _SHAPE, vclass, size, shape)
    for name, (vclass, *size) in SIZES.items():
        yield _sized(name, vclass, size, "")


def _sized(name: str, vclass: str, size: list[float], shape: str) -> Row:
    """A row whose type says its size, and its shape if there is one."""
    length, width, height = size
    said = f'length="{length}" width="{width}" height="{height}"'
    shape = f" guiShape={quoteattr(shape)}" if shape else ""
    return Row(name, vclass, (length, width, height), said + shape)


def write_log(folder: Path) -> Path:
    """Write network, routes and log of the parade; return the routes' file."""
    folder.mkdir(parents=True, exist_ok=True)
    listed = list(rows())
    (folder / "parade.nod.xml").write_text(_nodes(listed), encoding="utf-8")
    (folder / "parade.edg.xml").write_text(_edges(listed), encoding="utf-8")
    routes = folder / "parade.rou.xml"
    routes.write_text(_routes(listed), encoding="utf-8")
    sources = [
        f"--node-files={folder / 'parade.nod.xml'}",
        f"--edge-files={folder / 'parade.edg.xml'}",
    ]
    net, log = folder / "parade.net.xml", folder / "parade.fcd.xml.gz"
    _run(
        "netconvert",
        *sources,
        f"--output-file={net}",
        "--no-turnarounds",
        "--offset.disable-normalization",
    )
    # Trains without signals and people on roads are warned of; both are meant.
    _run(
        *("sumo", f"--net-file={net}", f"--route-files={routes}", f"--fcd-output={log}"),
        *(f"--end={SECONDS}", "--step-length=0.5", "--fcd-output.attributes=all", "--no-warnings"),
    )
    for name in ("parade.nod.xml", "parade.edg.xml"):
        (folder / name).unlink()
    return routes


def _run(*command: str) -> None:
    """Run one of SUMO's programs."""
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def _places(listed: list[Row]) -> Iterator[tuple[Row, float]]:
    """Each row and its y [m]."""
    y = 0.0
    for row in listed:
        y += 0.5 * row.size[1] + 3.0
        yield row, round(y, 2)
        y += 0.5 * row.size[1] + 3.0


def _nodes(listed: list[Row]) -> str:
    """Ends of all edges."""
    lines = [
        f'<node id="{row.name}_{end}" x="{x}" y="{y}"/>'
        for row, y in _places(listed)
        for end, x in (("a", 0.0), ("b", LENGTH))
    ]
    return "<nodes>\n" + "\n".join(lines) + "\n</nodes>\n"


def _edges(listed: list[Row]) -> str:
    """One edge for each row, for its class alone; buses and lorries also let people walk."""
    lines = []
    for row in listed:
        people = {"bus": " pedestrian", "wheelchair": " pedestrian", "truck": " container"}.get(
            row.name, ""
        )
        ends = f'from="{row.name}_a" to="{row.name}_b"'
        width = max(2.0, min(row.size[1] + 0.6, 30.0))
        lines.append(
            f'<edge id="{row.name}" {ends} numLanes="1" speed="{SPEED}" width="{width:.2f}"'
            f' allow="{row.vclass}{people}"/>'
        )
    return "<edges>\n" + "\n".join(lines) + "\n</edges>\n"


def _routes(listed: list[Row]) -> str:
    """Types, vehicles, people and containers."""
    lines = [
        f'<vType id="{row.name}" vClass="{row.vclass}" {row.attributes} maxSpeed="{SPEED}"/>'
        for row in listed
    ]
    for row in listed:
        lines.append(_user(row))
    lines.append(
        f'<person id="rider" depart="0" departPos="{START - 6}">'
        '<ride from="bus" to="bus" lines="bus"/></person>'
    )
    lines.append(
        f'<container id="load" depart="0" departPos="{START - 6}">'
        '<transport from="truck" to="truck" lines="truck"/></container>'
    )
    return "<routes>\n" + "\n".join(lines) + "\n</routes>\n"


def _user(row: Row) -> str:
    """A vehicle, or a person or container that goes along its edge."""
    common = f'id="{row.name}" type="{row.name}" depart="0" departPos="{START}"'
    walk = f'edges="{row.name}" arrivalPos="{LENGTH}"'
    if row.vclass in WALKERS:
        return f"<person {common}><walk {walk}/></person>"
    if row.vclass == "container":
        return f"<container {common}><tranship {walk}/></container>"
    waits = {"bus": "triggered", "truck": "containerTriggered"}.get(row.name)
    stop = f'<stop lane="{row.name}_0" endPos="{START + 1}" {waits}="true"/>' if waits else ""
    return f'<vehicle {common}><route edges="{row.name}"/>{stop}</vehicle>'


def draw(routes: Path, picture: Path) -> None:
    """Draw everyone whose type is in a routes file, as films show it."""
    drawn = picture.with_suffix(".png")
    order = catalogue.SheetOrder("classes", drawn, (240, 135), "preview", columns=6, counted=False)
    kinds = read_vehicle_types([routes])
    catalogue.draw_exhibits([_exhibit(kind) for kind in kinds.values()], order)
    if picture != drawn:
        _write_small(drawn, picture)
        drawn.unlink()


def _write_small(drawn: Path, picture: Path) -> None:
    """Write a PNG as a JPEG of at most `MOST_BYTES`, as good as that allows."""
    from PIL import Image

    with Image.open(drawn) as image:
        for quality in range(88, 30, -4):
            image.convert("RGB").save(picture, quality=quality, optimize=True)
            if picture.stat().st_size <= MOST_BYTES:
                return


def _exhibit(kind: VehicleType) -> Exhibit:
    """A road user on a grid, a person beside it."""
    kind = replace(kind, length=min(kind.length, LONGEST))
    looks = looks_for(())
    options = {"models": models_for({}), "own": {}, "seed": 1, "looks": looks}
    choice = choose(kind, name=kind.id, **options)
    body = build_body(choice, {})
    colour = paint_of(
        choice.vclass if hasattr(choice, "vclass") else "pedestrian",
        kind,
        key=kind.id,
        colours="european",
        seed=1,
    )
    parts = []
    for unit in body.assembly.units:
        frame = Transform(np.diag([*body.scale, 1.0])) @ Transform.from_pose((unit.at, 0.0, 0.0))
        for part in unit.prototype.parts:
            parts.append(_painted(Part(frame.mesh(part.mesh), part.material, part.tint), colour))
    person = VehicleType("", "pedestrian", 0.215, 0.478, 1.719)
    beside = build_body(choose(person, name="scale", **options), {})
    # Left of the front in the picture, where nothing is hidden.
    place = Transform.from_pose((0.5, -0.5 * body.size[1] - 0.4, 0.0))
    for part in beside.prototype.parts:
        parts.append(
            _painted(Part(place.mesh(part.mesh), part.material, part.tint), (0.1, 0.2, 0.4))
        )
    parts.append(Part(_grid(body.size[0], body.size[1]), "parade_grid"))
    line = principled((0.3, 0.3, 0.29), roughness=0.9)
    title = kind.gui_shape if kind.id.endswith(_SHAPE) else kind.id
    return Exhibit(title, tuple(parts), {**MATERIALS, **body.materials, "parade_grid": line})


def _painted(part: Part, colour: Colour) -> Part:
    """A part whose colour is the road user's, if it has none of its own."""
    if part.tint is not None or not is_tinted(MATERIALS.get(part.material, {})):
        return part
    return Part(part.mesh, part.material, np.tile(colour, (len(part.mesh.faces), 1)))


def _grid(length: float, width: float) -> Mesh:
    """Lines on the ground, 1 m apart, or 10 m under what is longer than 30 m."""
    step = 1.0 if length < 30.0 else 10.0
    thick, half = 0.015 * step, step * np.ceil((0.5 * width + 1.2) / step)
    xs = np.arange(-np.ceil(length / step) * step, 0.5 * step, step)
    ys = np.arange(-half, half + 0.5 * step, step)
    lines = [box((x - thick, -half, 0.0), (x + thick, half, 0.003)) for x in xs]
    lines += [box((xs[0], y - thick, 0.0), (0.0, y + thick, 0.003)) for y in ys]
    return merge_meshes(lines)


def main() -> None:
    """Write the log that the command line names, and draw its road users if it asks for that."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where network, routes and log go")
    parser.add_argument("--sheet", type=Path, help="picture of all road users, .png or .jpg")
    options = parser.parse_args()
    routes = write_log(options.folder)
    if options.sheet:
        draw(routes, options.sheet)


if __name__ == "__main__":
    main()
