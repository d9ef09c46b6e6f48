"""Meshes of signal heads, of what carries them, and of everything in them that shines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from sumo3dviz_pt.library.street import figures, level_crossing, traffic_light
from sumo3dviz_pt.library.street.road_styles import SignalStyle
from sumo3dviz_pt.model.geometry import (
    Colour,
    Floats,
    Ints,
    Mesh,
    Transform,
    belonging,
    merge_meshes,
)
from sumo3dviz_pt.model.lamps import LampSet, Lobe
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.placement.things import thing_at
from sumo3dviz_pt.world.signals.aspects import GREEN, RED, YELLOW
from sumo3dviz_pt.world.signals.heads import ARM_BOTTOM, Head, Support

LAMP_SET = "signals"
"""Id of the only lamp set."""

STACK: Mapping[int, tuple[str, ...]] = {2: (GREEN, RED), 3: (GREEN, YELLOW, RED)}
"""Lamps of a head from the lowest up."""

LOBE = Lobe(0.06, 40.0)
"""Of a lens by night: half of its light beyond 10 degrees from the axis, as lenses have that
are to be seen along a street (EN 12368 tells them apart as extra wide, wide, medium and
narrow), and enough at the side to be seen lit."""

FAR = 150.0
"""Distance beyond which heads and poles are plainer [m]."""

GLASS: Mapping[str, Colour] = {
    RED: (0.12, 0.006, 0.006),
    YELLOW: (0.13, 0.055, 0.004),
    GREEN: (0.004, 0.075, 0.045),
}
"""Reflectance of lenses that are not lit."""

_DARK: Colour = (0.02, 0.02, 0.02)
_FIGURES = ("foot", "tram")
_SMALL = 0.62  # size of heads for cyclists against those for cars
_ARM = ARM_BOTTOM + 1.0


def static_parts(
    heads: Sequence[Head],
    supports: Sequence[Support],
    *,
    head_distances: Floats,
    support_distances: Floats,
    style: SignalStyle,
) -> tuple[StaticPart, ...]:
    """Build housings and poles, merged by material.

    Args:
        heads: All of them.
        supports: All of them.
        head_distances: Of each head from the nearest camera, (heads,) [m].
        support_distances: Of each support from the nearest camera, (supports,) [m].
        style: Colours of heads for vehicles.
    """
    levels = [(away > FAR).astype(np.int64) for away in (head_distances, support_distances)]
    found: dict[str, list[Mesh]] = {}
    for head, title, level in zip(heads, _titles(heads), levels[0], strict=True):
        thing = _thing(title)
        for material, mesh in _head(head, int(level), style).items():
            found.setdefault(material, []).append(belonging(_placed(mesh, head), thing))
    for support, level in zip(supports, levels[1], strict=True):
        for material, mesh in _support(support, int(level)).items():
            thing = thing_at("pole", support.position)
            found.setdefault(material, []).append(belonging(mesh, thing))
    return tuple(
        StaticPart(f"signals/{material}", "signals", Part(merge_meshes(meshes), material))
        for material, meshes in sorted(found.items())
    )


def lamp_set(heads: Sequence[Head]) -> LampSet:
    """Build all that shines as one mesh: lamps of every head, then bars of every counter."""
    meshes: list[Mesh] = []
    names: list[str] = []
    glass: list[Colour] = []
    titles = _titles(heads)
    for head, title in zip(heads, titles, strict=True):
        for i, colour in enumerate(STACK[head.lamps]):
            meshes.append(belonging(_placed(_lamp(head, i, colour), head), _thing(title)))
            names.append(f"{title}/{colour}")
            glass.append(_DARK if head.kind in _FIGURES else GLASS[colour])
    for head, title in zip(heads, titles, strict=True):
        for place in (0, 1) if head.counter else ():
            bars = figures.digit(place, head.lamps)
            meshes += [belonging(_placed(mesh, head), _thing(title)) for mesh in bars]
            names += [f"{title}/countdown/{place}{bar}" for bar in figures.BARS]
            glass += [_DARK] * len(bars)
    index = _lamp_of_face(meshes)
    tint = np.array(glass)[index]
    mesh = merge_meshes(meshes)
    return LampSet(LAMP_SET, "signals", mesh, index, tuple(names), weight=1.5, tint=tint, lobe=LOBE)


def counter_rows(number: int | None, colour: Colour) -> list[Colour]:
    """Return the radiance of the fourteen bars of a counter that shows a number, or nothing."""
    lit = figures.bars_of(number)
    return [
        colour if (place, bar) in lit else (0.0, 0.0, 0.0)
        for place in (0, 1)
        for bar in figures.BARS
    ]


def _titles(heads: Sequence[Head]) -> list[str]:
    """The beginning of the names of a head's lamps: light, link and number."""
    count: Counter[tuple[str, int]] = Counter()
    titles = []
    for head in heads:
        key = (head.tls, head.links[0])
        titles.append(f"{head.tls}/{head.links[0]}/{count[key]}")
        count[key] += 1
    return titles


def _thing(title: str) -> str:
    """What the faces of a head belong to, by the beginning of the names of its lamps."""
    return f"signal:{title}"


def _lamp_of_face(meshes: Sequence[Mesh]) -> Ints:
    """Number of the mesh that each face of them all belongs to."""
    return np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])


def _lamp(head: Head, index: int, colour: str) -> Mesh:
    """What shines: a lens, or a person for people."""
    if head.walks:
        return figures.walker(index, walking=colour == GREEN)
    if head.kind == "tram":
        return figures.tram_bar(index, {RED: "stop", YELLOW: "wait", GREEN: "go"}[colour])
    return traffic_light.lens(index)


def _placed(mesh: Mesh, head: Head) -> Mesh:
    """A mesh of a head where it hangs."""
    if head.kind == "bicycle":
        return Transform.from_pose(head.position, yaw=head.yaw, scale=_SMALL).mesh(mesh)
    return traffic_light.placed(mesh, head.position, head.yaw)


def _head(head: Head, level: int, style: SignalStyle) -> dict[str, Mesh]:
    """Everything of a head that does not shine, by material."""
    yellow = style.housing == "yellow" and head.kind == "vehicle"
    backed = head.kind == "rail" or (head.kind == "vehicle" and not yellow)
    rim = backed and (head.kind == "rail" or style.border == "white")
    parts = dict(_box(head.lamps, level, backed=backed, rim=rim, counter=head.counter))
    if head.kind in _FIGURES:
        windows = [figures.window(i, sides=20 - 12 * level) for i in range(head.lamps)]
        parts["glass"] = merge_meshes(windows)
    if yellow:
        parts["signal_housing_yellow"] = parts.pop("signal_housing")
    if head.over_road:
        top = _ARM - float(head.position[2] - head.foot[2])
        parts["signal_pole"] = traffic_light.hanger(head.lamps, top)
    elif not level:
        parts["signal_pole"] = traffic_light.bracket(head.lamps)
    return parts


@cache
def _box(lamps: int, level: int, *, backed: bool, rim: bool, counter: bool) -> Mapping[str, Mesh]:
    """The housing of a head, with a board behind it and a white rim around that, by material."""
    parts = {
        "signal_housing": traffic_light.housing(lamps, backing=backed, counter=counter, level=level)
    }
    if rim:
        parts["signal_border"] = traffic_light.border(lamps + counter)
    return parts


def _support(support: Support, level: int) -> dict[str, Mesh]:
    """A pole or a mast, with a crossbar for several heads, by material."""
    parts: dict[str, list[Mesh]] = {"signal_pole": []}
    if support.rail:
        for part in level_crossing.rail_mast(support.height, level=level):
            parts.setdefault(part.material, []).append(part.mesh)
    elif support.reach:
        mast = traffic_light.mast(support.height, support.reach, level=level)
        parts["signal_pole"].append(mast)
    else:
        parts["signal_pole"].append(traffic_light.pole(support.height, level=level))
    if support.bar:
        height = support.height - 0.4 if not support.reach else 2.9
        parts["signal_pole"].append(traffic_light.crossbar(support.bar, height))
    return {
        material: traffic_light.placed(merge_meshes(meshes), support.position, support.yaw)
        for material, meshes in parts.items()
    }
