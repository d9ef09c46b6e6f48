"""What a recipe lays on a car's body: bars of grilles, strips, round lamps, badges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from bakery.car.body import CarShape
from bakery.car.conform import CarFineness, bar, land, resampled
from bakery.car.recipe import BodyStrip, CarPanel, Disc
from sumo3dviz_pt.library.mesh.solids import lathe, on_both_sides
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform, settled

Profile = Sequence[tuple[float, float]]

_MIDDLE = 1e-6


def ornaments(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """Build the bars, strips and discs of a recipe on both sides."""
    recipe = shape.recipe
    for panel in recipe.panels:
        for strip in panel_bars(panel):
            yield from on_both_sides([(strip.material, strip_mesh(shape, strip, level))])
    for strip in recipe.strips:
        yield from on_both_sides([(strip.material, strip_mesh(shape, strip, level))])
    for disc in recipe.discs:
        central = disc.view != "side" and abs(disc.at[disc.view == "top"]) < _MIDDLE
        made = _disc(shape, disc, level)
        yield from made if central else on_both_sides(made)


def strip_mesh(shape: CarShape, strip: BodyStrip, level: CarFineness) -> Mesh:
    """Build the bar of a strip on the left side.

    Args:
        shape: The body.
        strip: Where it runs and what it is like.
        level: How finely it is made.
    """
    spots = land(shape, strip.view, resampled(strip.path, level.step))
    return bar(spots, strip.width, height=strip.height, depth=strip.depth, bevelled=level.bevels)


def panel_bars(panel: CarPanel) -> Iterator[BodyStrip]:
    """Return the bars of a grille, within its recess."""
    count, outline = abs(panel.bars), np.asarray(panel.outline)
    if not count:
        return
    lying = panel.bars > 0
    along, across = (outline, 1) if lying else (outline[:, ::-1], 0)
    low, high = outline[:, across].min(), outline[:, across].max()
    pitch = (high - low) / count
    for k in range(count):
        at = low + (k + 0.5) * pitch
        ends = _chord(along, at)
        if ends is None or ends[1] - ends[0] < 0.03:
            continue
        path = [(end, at) if lying else (at, end) for end in ends]
        recess = max(panel.recess, 0.008)
        yield BodyStrip(
            panel.view,
            tuple(path),
            panel.bar_material,
            0.42 * pitch,
            height=-0.3 * recess,
            depth=recess,
        )


def _chord(outline: Floats, height: float) -> tuple[float, float] | None:
    """Where a level line lies within an outline, (n, 2), a little short of its sides [m]."""
    ahead = np.roll(outline, -1, axis=0)
    cut = settled((outline[:, 1] - height) * (ahead[:, 1] - height)) < 0.0
    if cut.sum() < 2:
        return None
    a, b = outline[cut], ahead[cut]
    at = a[:, 0] + (b[:, 0] - a[:, 0]) * (height - a[:, 1]) / (b[:, 1] - a[:, 1])
    low, high = float(at.min()), float(at.max())
    # Bars that begin in the middle meet their mirror image there.
    return (low + 0.004 if abs(low) > _MIDDLE else low), high - 0.004


def _disc(shape: CarShape, disc: Disc, level: CarFineness) -> Iterator[MaterialMesh]:
    """A round piece on the left side or in the middle."""
    spot = land(shape, disc.view, [disc.at])
    # Lamps look between their view and where the body does, badges lie flat on it.
    share = {"badge": 1.0, "eye": 0.75, "tip": 0.0}.get(disc.style, 0.35)
    way = (1.0 - share) * _facing(disc.view) + share * spot.normals[0]
    way = way / np.linalg.norm(way)
    centre = spot.points[0] + disc.height * way
    if disc.style == "tip":
        # A pipe ends a little behind the skirt over it.
        centre = spot.points[0] * [1.0, 0.0, 0.0] + [0.01 * way[0], *disc.at]
    turn = _turned(way)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, centre
    for material, profile in _STYLES[disc.style].items():
        scaled = np.asarray(_thinned(profile) if level.sides < 12 else profile) * disc.radius
        mesh = lathe(scaled.tolist(), segments=level.sides, crease=0.6)
        yield material, Transform(pose).mesh(mesh)


def _thinned(profile: Profile) -> Profile:
    """Every other point of a profile, and its ends."""
    return [*profile[:-1:2], profile[-1]]


def _facing(view: str) -> Floats:
    """Where a view's pieces look, (3,)."""
    ways = {"front": (1.0, 0.0, 0.0), "rear": (-1.0, 0.0, 0.0), "side": (0.0, 1.0, 0.0)}
    return np.array(ways.get(view, (0.0, 0.0, 1.0)))


def _turned(way: Floats) -> Floats:
    """A rotation that takes +y to a direction, (3, 3)."""
    up = np.array([0.0, 0.0, 1.0]) if abs(way[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    side = np.cross(way, up)
    side /= np.linalg.norm(side)
    return np.column_stack([side, way, np.cross(side, way)])


_LENS: Profile = ((0.66, -0.5), (0.66, -0.16), (0.56, -0.04), (0.36, 0.06), (0.0, 0.12))
_RING: Profile = ((1.0, -0.8), (1.0, 0.0), (0.93, 0.05), (0.84, 0.0), (0.76, -0.25), (0.66, -0.3))
_BOWL: Profile = ((1.0, -0.8), (1.0, 0.0), (0.94, 0.03), (0.88, -0.05), (0.62, -0.34), (0.25, -0.5))
_BULB: Profile = ((0.25, -0.5), (0.24, -0.2), (0.15, -0.1), (0.0, -0.08))

_STYLES: Mapping[str, Mapping[str, Profile]] = {
    "projector": {"chrome": _RING, "lamp_white": _LENS},
    "reflector": {"lamp_bowl": _BOWL, "lamp_white": _BULB},
    "eye": {
        "chrome": ((1.0, -0.5), (1.0, 0.0), (0.96, 0.03), (0.9, 0.0), (0.88, -0.06)),
        "lamp_white": ((0.88, -0.06), (0.84, -0.03), (0.76, -0.03), (0.74, -0.08)),
        "lamp_bowl": ((0.74, -0.08), (0.62, -0.24), (0.42, -0.32)),
        "lamp_clear": ((0.42, -0.32), (0.4, -0.05), (0.3, 0.03), (0.0, 0.08)),
    },
    "fog": {
        "gloss_black": ((1.0, -0.5), (1.0, 0.0), (0.9, 0.06), (0.78, 0.0), (0.76, -0.1)),
        "lamp_bowl": ((0.76, -0.1), (0.5, -0.3), (0.3, -0.36)),
        "lamp_white": ((0.3, -0.36), (0.28, -0.1), (0.0, -0.02)),
    },
    "badge": {
        "chrome": ((1.0, -0.3), (1.0, 0.08), (0.9, 0.14), (0.78, 0.1), (0.74, 0.02)),
        "gloss_black": ((0.74, 0.02), (0.4, 0.05), (0.0, 0.06)),
    },
    "tip": {
        "chrome": ((1.0, -3.0), (1.0, -0.1), (0.97, 0.0), (0.88, -0.05), (0.86, -0.4)),
        "gap": ((0.86, -0.4), (0.0, -0.5)),
    },
}
"""Profiles by material: (radius, place along the axis), in radii."""
