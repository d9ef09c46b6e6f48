"""What the two example scenarios' build scripts share: SUMO's tools, files and free ground.

Everything written here is a pure function of its arguments: no clock, no machine
path, sorted attributes in the order given, so that rebuilding changes no byte.
"""

from __future__ import annotations

import gzip
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Words = dict[str, object]  # an element's attributes

# Ground that a building takes as a radius [m], and how far its middle keeps from every lane [m].
FOOTPRINT = {"home": 9.0, "shop": 12.0, "block": 17.0}
SETBACK = {"home": 14.0, "shop": 16.0, "block": 21.0}

# id: (vClass, length [m], width [m], height [m], desired speed [m/s], share, further attributes).
VEHICLE_TYPES = {
    "car_small": ("passenger", 3.8, 1.70, 1.50, 38, 0.22, {}),
    "car_medium": ("passenger", 4.4, 1.80, 1.47, 42, 0.32, {}),
    "car_estate": ("passenger", 4.8, 1.85, 1.49, 45, 0.16, {"guiShape": "passenger/wagon"}),
    "car_suv": ("passenger", 4.7, 1.90, 1.70, 42, 0.16, {}),
    "van": ("delivery", 5.9, 2.00, 2.60, 36, 0.07, {"guiShape": "delivery"}),
    "truck": ("truck", 9.0, 2.50, 3.60, 25, 0.03, {"guiShape": "truck"}),
    "semitrailer": ("trailer", 16.5, 2.55, 4.00, 25, 0.01, {"guiShape": "truck/semitrailer"}),
    "bus": ("bus", 12.0, 2.55, 3.20, 28, 0.01, {"guiShape": "bus"}),
    "motorcycle": ("motorcycle", 2.2, 0.80, 1.50, 45, 0.02, {"guiShape": "motorcycle"}),
}


def element(tag: str, attributes: Mapping[str, object], children: Iterable[str] = ()) -> str:
    """One XML element; numbers are written with two decimals."""
    words = [
        f'{k}="{v:.2f}"' if isinstance(v, float) else f'{k}="{v}"' for k, v in attributes.items()
    ]
    head, inner = " ".join([tag, *words]), "\n    ".join(children)
    return f"<{head}>\n    {inner}\n</{tag}>" if inner else f"<{head}/>"


def write_xml(path: Path, root: str, children: Iterable[str]) -> None:
    """Write an XML file of one root and its children."""
    text = element(root, {}, children)
    path.write_text(
        f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n', encoding="utf-8", newline="\n"
    )


def vehicle_types(late: float = 0.0) -> list[str]:
    """The vTypes and, as `traffic`, the distribution of motor traffic over them.

    Args:
        late: How long after a light turned red drivers who cannot stop still pass [s].
    """
    types = []
    for name, (vclass, length, width, height, speed, share, more) in VEHICLE_TYPES.items():
        size = {"length": length, "width": width, "height": height, "maxSpeed": speed}
        types.append(
            element(
                "vType",
                {"id": name, "vClass": vclass, **size, "probability": share, **more}
                | {
                    "speedFactor": "normc(1,0.08,0.8,1.2)",
                    "lcStrategic": 3,
                    "jmDriveAfterRedTime": late or -1,
                },
            )
        )
    return [element("vTypeDistribution", {"id": "traffic"}, types)]


def stream(name: str, *, rate: float, end: int) -> Words:
    """Attributes of a flow of `rate` road users per hour that appear at random until `end` [s]."""
    return {"id": name, "begin": 0, "end": end, "period": f"exp({rate / 3600.0:.5f})"}


def points(line: Floats) -> str:
    """A polyline, (n, 2) [m], in SUMO's spelling."""
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in line)


def offset(line: Floats, distance: float) -> Floats:
    """The parallel of a gentle polyline, (n, 2) [m], to its right for a positive distance [m]."""
    step = np.gradient(line, axis=0)
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    return line + distance * np.stack([step[:, 1], -step[:, 0]], axis=1)


def run_tool(tool: str, *options: str, folder: Path) -> None:
    """Run one of SUMO's programs of this Python's installation in a folder."""
    import sumo  # type: ignore[import-untyped]

    place = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    program = shutil.which(tool, path=place)
    if program is None:
        raise FileNotFoundError(f"{tool} is not installed; pip install eclipse-sumo")
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run([program, *options], cwd=folder, env=environment, check=True)


def clean(path: Path, begin: float | None = None) -> None:
    """Remove SUMO's header (date, machine paths) and time steps before `begin` [s]; zip anew."""
    text = gzip.decompress(path.read_bytes()).decode("utf-8")
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    if begin is not None:
        first = text.index(f'<timestep time="{begin:.2f}"')
        text = text[: text.index("<timestep")] + text[first:]
    data = text.replace("\r\n", "\n").encode("utf-8")
    path.write_bytes(gzip.compress(data, compresslevel=9, mtime=0))


def lane_ground(network: Path) -> shapely.Geometry:
    """Everything that belongs to a lane, walking area or junction of a network."""
    text = gzip.decompress(network.read_bytes()).decode("utf-8")
    parts: list[shapely.Geometry] = []
    for width, shape in re.findall(
        r'<lane id="[^"]*"[^>]*?(?:width="([\d.]+)")?[^>]*? shape="([^"]+)"', text
    ):
        line = np.array([point.split(",")[:2] for point in shape.split()], dtype=np.float64)
        parts.append(shapely.LineString(line).buffer(float(width or 3.2) / 2.0, cap_style="flat"))
    for shape in re.findall(r'<junction id="[^":]*"[^>]* shape="([^"]+)"', text):
        outline = [tuple(map(float, point.split(",")[:2])) for point in shape.split()]
        parts.append(
            shapely.Polygon(outline).buffer(0.0)
            if len(outline) > 2
            else shapely.LineString(outline)
        )
    return shapely.union_all(parts)


def thin(
    candidates: Sequence[tuple[str, float, float, float]],
    ground: shapely.Geometry,
) -> dict[str, list[tuple[float, float, float]]]:
    """Keep, in order, the buildings that stand clear of all lanes and of those kept before.

    Args:
        candidates: Kind, x [m], y [m], and the front's direction [deg from north, clockwise].
        ground: What lanes cover.

    Returns:
        The places (x, y, front) by kind.
    """
    kept: dict[str, list[tuple[float, float, float]]] = {kind: [] for kind in FOOTPRINT}
    for kind, x, y, front in candidates:
        room = [
            np.hypot(x - a, y - b) >= FOOTPRINT[kind] + FOOTPRINT[other] + 1.0
            for other, places in kept.items()
            for a, b, _ in places
        ]
        if all(room) and ground.distance(shapely.Point(x, y)) >= SETBACK[kind]:
            kept[kind].append((x, y, front))
    return kept


def plant(
    candidates: Floats,
    ground: shapely.Geometry,
    buildings: Mapping[str, list[tuple[float, float, float]]],
    spacing: float = 4.0,
    clear: float = 4.0,
) -> Floats:
    """Keep, in order, the trees, (n, 2) [m], clear of lanes, buildings and one another.

    Args:
        candidates: (n, 2) [m].
        ground: What lanes cover.
        buildings: The places (x, y, front) by kind.
        spacing: Between trees, at least [m].
        clear: From lanes, at least [m].
    """
    kept: list[Floats] = []
    for tree in candidates:
        near = [np.hypot(*(tree - other)) < spacing for other in kept]
        walls = [
            np.hypot(tree[0] - x, tree[1] - y) < FOOTPRINT[kind] + 2.5
            for kind, places in buildings.items()
            for x, y, _ in places
        ]
        if not any(near) and not any(walls) and ground.distance(shapely.Point(tree)) >= clear:
            kept.append(tree)
    return np.array(kept)


def write_objects(
    folder: Path,
    buildings: Mapping[str, list[tuple[float, float, float]]],
    trees: Floats,
) -> None:
    """Write one additional file of POIs per kind; `angle` is where a building's front looks."""
    for kind, places in buildings.items():
        pois = [
            element(
                "poi",
                {
                    "id": f"{kind}_{i}",
                    "type": kind,
                    "x": float(x),
                    "y": float(y),
                    "angle": float(a),
                },
            )
            for i, (x, y, a) in enumerate(places)
        ]
        write_xml(folder / f"{kind}s.add.xml", "additional", pois)
    pois = [
        element("poi", {"id": f"tree_{i}", "type": "tree", "x": float(x), "y": float(y)})
        for i, (x, y) in enumerate(trees)
    ]
    write_xml(folder / "trees.add.xml", "additional", pois)


def write_configuration(
    folder: Path, *, begin: int, end: int, seed: int, more: Iterable[str] = ()
) -> None:
    """Write the order for the signal log, and `<name>.sumocfg`, which names every file.

    Args:
        folder: The example's folder; its name is the example's.
        begin: When the vehicle log begins [s].
        end: When the simulation ends [s].
        seed: SUMO's seed.
        more: Further additional files.
    """
    order = element("timedEvent", {"type": "SaveTLSSwitchStates", "dest": "signals.xml.gz"})
    write_xml(folder / "signal_log.add.xml", "additional", [order])
    objects = [f"{kind}.add.xml" for kind in ("trees", "fences", "homes", "shops", "blocks")]
    objects = [name for name in objects if (folder / name).exists()]
    additional = ",".join(["signal_log.add.xml", *more, *objects])
    name = folder.name
    sections: dict[str, Words] = {
        "input": {
            "net-file": f"{name}.net.xml.gz",
            "route-files": f"{name}.rou.xml",
            "additional-files": additional,
        },
        "output": {"fcd-output": "fcd.xml.gz", "fcd-output.signals": "true"},
        "time": {"begin": 0, "end": end, "step-length": 1},
        "processing": {
            "lanechange.duration": 3,
            "time-to-teleport": -1,
            "collision.action": "warn",
        },
        "report": {"no-step-log": "true", "duration-log.disable": "true"},
        "random_number": {"seed": seed},
        "fcd_device": {"device.fcd.begin": begin},
    }
    children = [
        element(section, {}, [element(key, {"value": value}) for key, value in entries.items()])
        for section, entries in sections.items()
    ]
    write_xml(folder / f"{name}.sumocfg", "configuration", children)


def simulate(folder: Path, *, begin: int) -> None:
    """Run SUMO on an example and clean its logs; the vehicle log starts at `begin` [s]."""
    run_tool("sumo", "-c", f"{folder.name}.sumocfg", folder=folder)
    clean(folder / "fcd.xml.gz", begin)
    clean(folder / "signals.xml.gz")
