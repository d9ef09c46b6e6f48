"""Wheels: tyre with grooves, rim with spokes or a disc, brake, and darkness behind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from bakery.car.conform import closed
from bakery.car.recipe import WheelRecipe
from sumo3dviz_pt.library.mesh.solids import by_material, lathe, shaded
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh

_SEGMENTS = (20, 56)
"""Facets around, plain and fine."""

_BRAKE = 0.62
"""Radius of the brake disc as a share of the rim's."""


def build_wheel(recipe: WheelRecipe, *, fine: bool = False) -> Mapping[str, Mesh]:
    """Build a wheel around the y axis with its outer face towards +y.

    Args:
        recipe: The wheel.
        fine: Whether it is seen from nearby: grooves, bevels and a calliper.

    Returns:
        Meshes by material, centred on the axle.
    """
    segments = _SEGMENTS[fine]
    pieces = [("rubber", _tyre(recipe, segments, fine)), *_inside(recipe, segments, fine)]
    pieces += list(_barrel(recipe, segments))
    pieces += list(_cover(recipe, segments) if recipe.spokes == 0 else _star(recipe, fine))
    if fine:
        pieces.append(("tyre_text", _lettered(recipe)))
    return by_material(pieces)


def well_shell(radius: float, span: tuple[float, float], *, lowest: float) -> Mesh:
    """Build the inside of a wheel well above the axle: an arch and a wall behind it.

    Args:
        radius: Of the arch [m].
        span: y of the wall and of the open end [m].
        lowest: Where the arch ends, above the axle [m].
    """
    begin = float(np.arcsin(lowest / radius))
    turn = np.linspace(begin, np.pi - begin, 17)
    x, z = radius * np.cos(turn), radius * np.sin(turn)
    arch = [np.stack([x, np.full_like(x, y), z], axis=1) for y in span]
    vertices = np.concatenate(arch)
    a = np.arange(16)
    quads = [(a, a + 1, a + 18), (a, a + 18, a + 17)]
    wall = np.stack([np.zeros(15, dtype=int), a[1:] + 1, a[1:]], axis=1)
    faces = np.concatenate([np.stack(q, axis=1) for q in quads] + [wall])
    return shaded(vertices, faces, crease=0.5)


def _tyre(recipe: WheelRecipe, segments: int, fine: bool) -> Mesh:
    """Tread, grooved when fine, and side walls that bulge."""
    r, w, rim = recipe.radius, recipe.width / 2.0, recipe.radius * recipe.rim
    wall = r - rim
    inner = [(rim - 0.03, -0.85 * w), (rim + 0.35 * wall, -w), (r - 0.22 * wall, -0.97 * w)]
    outer = [(r - 0.22 * wall, 0.97 * w), (rim + 0.35 * wall, w), (rim + 0.004, 0.90 * w)]
    if not fine:
        profile = [inner[0], inner[2], (r, -0.78 * w), (r, 0.78 * w), *outer]
        return lathe(profile, segments=segments, crease=1.2)
    ring = [(rim + 0.62 * wall, 0.995 * w), (rim + 0.60 * wall, 1.012 * w)]
    ring += [(rim + 0.40 * wall, 1.012 * w), (rim + 0.38 * wall, w), (rim + 0.12 * wall, 0.95 * w)]
    ring += [(rim + 0.11 * wall, 0.97 * w), (rim + 0.05 * wall, 0.93 * w)]
    shoulder = [(r - 0.008, 0.86 * w), (r - 0.002, 0.8 * w)]
    tread = [(depth, place * w) for place, depth in _tread(r)]
    back = [(radius, -y) for radius, y in shoulder]
    profile = [*inner, *back, *tread, *shoulder[::-1], outer[0], *ring, outer[2], (rim, 0.8 * w)]
    return lathe(profile, segments=segments, crease=0.6)


def _lettered(recipe: WheelRecipe) -> Mesh:
    """The letters on a tyre's side wall, twice around it."""
    r, w, rim = recipe.radius, recipe.width / 2.0, recipe.radius * recipe.rim
    wall = r - rim
    middle, height = rim + 0.5 * wall, 0.15 * wall
    size = f"{round(200.0 * recipe.width) * 5}/{round(20.0 * wall / recipe.width) * 5}"
    flats = []
    for text, turn in (("CONTURA", 0.0), (f"{size} R{round(78.7 * rim)}", np.pi)):
        corners = lettering(text, height=height, weight=0.2, gap=0.34).reshape(-1, 2)
        angle, radius = turn + corners[:, 0] / middle, middle + corners[:, 1]
        place = np.full(len(corners), 1.012 * w + 0.0016)
        flats.append(np.column_stack([radius * np.sin(-angle), place, radius * np.cos(angle)]))
    vertices = np.concatenate(flats)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return shaded(vertices, _outwards(vertices, faces), crease=0.3)


def _outwards(vertices: Floats, faces: Ints) -> Ints:
    """Faces, (n, 3), turned so that they look to +y."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    back = np.cross(b - a, c - a)[:, 1] < 0.0
    return np.where(back[:, None], faces[:, ::-1], faces)


def _tread(r: float) -> Iterator[tuple[float, float]]:
    """Place across and radius of a tread with four grooves."""
    for groove in (-0.54, -0.18, 0.18, 0.54):
        for step, depth in ((-0.06, 0.0), (-0.045, 0.008), (0.045, 0.008), (0.06, 0.0)):
            yield groove + step, r - depth


def _inside(recipe: WheelRecipe, segments: int, fine: bool) -> Iterator[MaterialMesh]:
    """The brake behind the spokes, darkness behind it, and the wheel's back."""
    rim, w = recipe.radius * recipe.rim, recipe.width / 2.0
    yield "gap", lathe([(rim - 0.012, -0.05 * w), (0.0, -0.05 * w)], segments=segments)
    yield "gap", lathe([(0.0, -0.85 * w), (rim - 0.02, -0.85 * w)], segments=segments // 2)
    if recipe.spokes == 0:
        return
    brake, y = _BRAKE * rim, 0.2 * w
    profile = [(brake, y - 0.02), (brake, y), (0.45 * brake, y), (0.42 * brake, y + 0.03)]
    profile += [(0.0, y + 0.03)]
    yield "disc", lathe(profile if fine else profile[1:3], segments=segments, crease=0.5)
    if fine:
        yield "gloss_black", _sector((0.66 * brake, 1.1 * brake), (y - 0.02, y + 0.035))


def _sector(radii: tuple[float, float], span: tuple[float, float]) -> Mesh:
    """A calliper: a block around the rear of a brake disc, about its axle."""
    turn = np.radians(np.linspace(-28.0, 28.0, 7))
    rings = [
        np.column_stack([-r * np.cos(turn), np.full(7, y), r * np.sin(turn)])
        for r, y in (
            (radii[0], span[0]),
            (radii[1], span[0]),
            (radii[1], span[1]),
            (radii[0], span[1]),
        )
    ]
    return _solid(np.stack(rings, axis=1))


def _solid(rings: Floats) -> Mesh:
    """A closed solid from rings of equally many vertices, (n, k, 3)."""
    return closed(rings.reshape(-1, 3), rings.shape[0], rings.shape[1])


def _barrel(recipe: WheelRecipe, segments: int) -> Iterator[MaterialMesh]:
    """The rim's lip and the inside of its barrel."""
    rim, w = recipe.radius * recipe.rim, recipe.width / 2.0
    lip = [(rim + 0.006, 0.86 * w), (rim + 0.005, 0.93 * w), (rim - 0.012, 0.91 * w)]
    lip += [(rim - 0.017, 0.80 * w)]
    yield "rim", lathe(lip, segments=segments, crease=0.9)
    deep = [(rim - 0.017, 0.80 * w), (rim - 0.026, 0.0)]
    material = "gloss_black" if recipe.two_tone else "rim_dust"
    yield material, lathe(deep, segments=segments, crease=0.9)


def _cover(recipe: WheelRecipe, segments: int) -> Iterator[MaterialMesh]:
    """A steel wheel's cover: a dished disc with dark slots."""
    rim, w = recipe.radius * recipe.rim, recipe.width / 2.0
    disc = [(rim - 0.012, 0.80 * w), (0.93 * rim, 0.84 * w), (0.84 * rim, 0.80 * w)]
    disc += [
        (0.58 * rim, 0.86 * w),
        (0.34 * rim, 0.84 * w),
        (0.28 * rim, 0.90 * w),
        (0.0, 0.93 * w),
    ]
    yield "rim", lathe(disc, segments=segments, crease=0.5)
    outline = np.array([(0.66, -0.1), (0.86, -0.15), (0.89, 0.0), (0.86, 0.15), (0.66, 0.1)]) * rim
    for turn in 2.0 * np.pi * np.arange(9) / 9:
        c, s = np.cos(turn), np.sin(turn)
        r, x = outline.T
        flat = np.column_stack([r * s + x * c, np.full(5, 0.845 * w + 0.003), r * c - x * s])
        yield "gap", shaded(flat, np.array([(0, 2, 1), (0, 3, 2), (0, 4, 3)]), crease=0.3)


def _star(recipe: WheelRecipe, fine: bool) -> Iterator[MaterialMesh]:
    """Hub with cap and nuts, and the spokes."""
    rim, w = recipe.radius * recipe.rim, recipe.width / 2.0
    sides = 28 if fine else 10
    hub = [(0.078, 0.30 * w), (0.074, 0.62 * w), (0.036, 0.70 * w)]
    yield "rim", lathe([*hub, (0.034, 0.70 * w)], segments=sides, crease=0.5)
    cap = [(0.034, 0.70 * w), (0.032, 0.77 * w), (0.0, 0.79 * w)]
    yield "gloss_black", lathe(cap, segments=sides, crease=0.5)
    if fine:
        for turn in 2.0 * np.pi * (np.arange(5) + 0.5) / 5:
            nut = lathe([(0.011, 0.5 * w), (0.011, 0.67 * w), (0.0, 0.67 * w)], segments=6)
            away = np.array([0.055 * np.sin(turn), 0.0, 0.055 * np.cos(turn)])
            yield "gap", Mesh(nut.vertices + away, nut.faces, nut.normals)
    apart = (0.5 * recipe.twin / rim,) if recipe.twin else ()
    for turn in 2.0 * np.pi * np.arange(recipe.spokes) / recipe.spokes:
        for lean in (*apart, *(-a for a in apart)) if apart else (0.0,):
            yield from _spoke(recipe, turn, lean, fine)


def _spoke(recipe: WheelRecipe, turn: float, lean: float, fine: bool) -> Iterator[MaterialMesh]:
    """A bar with bevelled edges from the hub to the rim, dished outwards."""
    rim, w = recipe.radius * recipe.rim, recipe.width / 2.0
    share = np.linspace(0.0, 1.0, 7 if fine else 3)
    radii = 0.05 + (rim - 0.062) * share
    face = w * (0.66 - 0.05 * np.sin(np.pi * share) + 0.20 * share**2)
    wide = 0.5 * recipe.spoke_width * (0.72 - 0.10 * np.sin(np.pi * share) + 0.28 * share)
    across = np.array([-1.0, -1.0, -0.72, 0.72, 1.0, 1.0])
    depth = np.array([-0.42 * w, -0.010, 0.0, 0.0, -0.010, -0.42 * w])
    if not fine:
        across, depth = across[[0, 2, 3, 5]], depth[[0, 2, 3, 5]]
    x = across[None, :] * wide[:, None]
    y = face[:, None] + depth[None, :]
    # The bars of a double spoke part on their way outwards.
    angle = (turn + lean * share)[:, None]
    c, s, r = np.cos(angle), np.sin(angle), radii[:, None]
    rings = np.stack([r * s + x * c, y, r * c - x * s], axis=-1)
    middle = rings.shape[1] // 2
    flanks = "gloss_black" if recipe.two_tone else "rim_dust"
    yield flanks, _sheet(rings[:, :middle])
    yield "rim", _sheet(rings[:, middle - 1 : middle + 1])
    yield flanks, _sheet(rings[:, middle:])


def _sheet(rows: Floats) -> Mesh:
    """An open strip of quads from rows of vertices, (n, k, 3), its columns clockwise from +y."""
    n, k = rows.shape[:2]
    i, j = np.meshgrid(np.arange(n - 1), np.arange(k - 1), indexing="ij")
    a = (i * k + j).reshape(-1)
    faces = np.concatenate([np.stack([a, a + k + 1, a + 1], 1), np.stack([a, a + k, a + k + 1], 1)])
    return shaded(rows.reshape(-1, 3), faces, crease=0.9)
