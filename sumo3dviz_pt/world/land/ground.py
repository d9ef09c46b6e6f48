"""The ground around the roads, out to beyond the horizon."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from sumo3dviz_pt.job.settings import GroundSettings
from sumo3dviz_pt.library.materials import (
    MATERIALS,
    mean_reflectance,
    metres_per_tile,
    planar_uvs,
    surface_material,
)
from sumo3dviz_pt.model.geometry import Bools, Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.network import GroundPicture, Network
from sumo3dviz_pt.model.scene import Bsdf, LampSet, Part, StaticPart
from sumo3dviz_pt.world.land.horizon import (
    FAR_GROUND,
    Land,
    Room,
    built_points,
    chosen_faces,
    far_tints,
    land_around,
    land_mesh,
    split_far,
    woods,
)
from sumo3dviz_pt.world.land.terrain import ground_between, terrain
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.structures.bridges import MATERIAL as CONCRETE
from sumo3dviz_pt.world.structures.bridges import SURFACE, build_parapets, build_structures
from sumo3dviz_pt.world.structures.tunnels import build_tunnels

DROP = 0.03
"""How far level ground lies below the road surface [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class GroundParts:
    """The ground, ready for the scene.

    Attributes:
        static: Its meshes.
        materials: Their materials by name.
        height_at: Height of the ground at places, (n, 2) -> (n,) [m].
        lamps: In tunnels.
    """

    static: tuple[StaticPart, ...]
    materials: dict[str, Bsdf]
    height_at: Callable[[Floats], Floats]
    lamps: tuple[LampSet, ...] = ()


def build_ground(
    settings: GroundSettings,
    network: Network,
    *,
    roads: RoadLayout,
    textured: bool,
    seed: int = 0,
    room: Room | None = None,
) -> GroundParts:
    """Build the ground: level, or a terrain that follows sloped roads from below.

    Around what is built lie fields, woods and hills, as `settings.horizon` says.

    Args:
        settings: Surface, its scale and the horizon.
        network: The network.
        roads: `RoadParts.layout`.
        textured: False gives a matt constant colour and no woods or hills.
        seed: Of hills, fields and woods.
        room: What woods leave free; default nothing.

    Raises:
        ConfigError: If the surface is unknown.
    """
    horizon = settings.horizon if textured else "flat"
    corners = built_points(roads.outline, network.location.boundary)
    corners = np.concatenate([corners, roads.beyond.points[:, :2]])
    land = land_around(corners, horizon=horizon, surface=settings.texture, seed=seed)
    key = ("ground", horizon, settings.texture, seed)
    shape = roads.memory.of(key, partial(_shape, roads, network, land))
    # Show a texture near what is built and plain colours beyond.
    name = f"ground:{settings.texture}"
    near, far = (shape.mesh, None) if land.plain else split_far(shape.mesh, land)
    tile = metres_per_tile(settings.texture) * settings.scale
    near = replace(
        near, uvs=planar_uvs(near.vertices, tile=tile, near=network.location.boundary[:2])
    )
    picture = network.picture if textured else None
    shown = [] if picture is None else [_seen(mesh, picture) for mesh in (near, far) if mesh]
    if picture is not None:
        near = _unseen(near, picture)
        far = None if far is None else _unseen(far, picture)
    static = [StaticPart("ground", "ground", Part(near, name)), *shape.walls]
    if picture is not None:
        photo = Part(merge_meshes(shown), str(picture.file))
        static.append(StaticPart("ground/picture", "ground", photo))
    eyes = None if room is None or room.camera_path is None else room.camera_path.positions
    static += build_parapets(roads, shape.height_at, eyes=eyes)
    if far is not None:
        tint = far_tints(far, land, mean_reflectance(settings.texture))
        static.append(StaticPart("ground/far", "ground", Part(far, FAR_GROUND, tint)))
    # Grow woods on it.
    free = room or Room(np.zeros((0, 2)))
    for number, part in enumerate(woods(land, height_at=shape.height_at, room=free)):
        static.append(StaticPart(f"ground/woods/{number}", "ground", part))
    materials: dict[str, Bsdf] = {name: surface_material(settings.texture, textured=textured)}
    for other in {part.part.material for part in static} - {name}:
        materials[other] = _look(other, picture, textured=textured)
    return GroundParts(tuple(static), materials, shape.height_at, tuple(shape.lamps))


def _look(name: str, picture: GroundPicture | None, *, textured: bool) -> Bsdf:
    """Return a material by its name; a picture's detail fades near the camera."""
    if name == CONCRETE:
        return surface_material(SURFACE, textured=textured)
    if picture is None or name != str(picture.file):
        return MATERIALS[name]
    x0, y0, x1, y1 = picture.box
    look = surface_material(name, textured=True)
    colour = {**look["reflectance"], "type": "draped", "metres": [x1 - x0, y1 - y0]}
    return {**look, "reflectance": colour}


def _within(mesh: Mesh, picture: GroundPicture) -> Bools:
    """Return which faces lie within a picture of the land, (m,)."""
    x0, y0, x1, y1 = picture.box
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    inside = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
    return np.asarray(inside[mesh.faces].all(axis=1))


def _seen(mesh: Mesh, picture: GroundPicture) -> Mesh:
    """Return what of the ground a picture shows, with the picture laid on it."""
    x0, y0, x1, y1 = picture.box
    part = chosen_faces(mesh, _within(mesh, picture))
    uvs = (part.vertices[:, :2] - [x0, y0]) / [x1 - x0, y1 - y0]
    return replace(part, uvs=uvs)


def _unseen(mesh: Mesh, picture: GroundPicture) -> Mesh:
    """Return the rest of the ground."""
    return chosen_faces(mesh, ~_within(mesh, picture))


@dataclass(frozen=True, slots=True, eq=False)
class _Shape:
    """The shape of the ground.

    Attributes:
        mesh: Of all of it.
        height_at: Its height at places, (n, 2) -> (n,) [m].
        walls: Bridges, retaining walls and linings of tunnels.
        lamps: In tunnels.
    """

    mesh: Mesh
    height_at: Callable[[Floats], Floats]
    walls: Sequence[StaticPart] = ()
    lamps: Sequence[LampSet] = ()


def _shape(roads: RoadLayout, network: Network, land: Land) -> _Shape:
    """The shape of the ground around roads: level without slopes, else a terrain."""
    if roads.cells.is_flat and network.heights is None and network.picture is None:
        level = road_level(roads, network) - DROP
        return _Shape(land_mesh(land, level), lambda places: level + land.heights(places))
    mesh, height_at = terrain(roads, network, land=land)
    below = build_tunnels(roads, ground_between(roads, network, land), height_at)
    mesh = merge_meshes([mesh, *below.lids])
    walls = (*build_structures(roads, below.height_at), *below.static)
    return _Shape(mesh, below.height_at, walls, below.lamps)


def road_level(roads: RoadLayout, network: Network) -> float:
    """Return the height of level roads [m]: of those that are built, or else of all."""
    quads = roads.cells.quads[..., 2]
    known: Floats = quads[np.isfinite(quads)]
    if not len(known):
        known = np.array([lane.shape[0, 2] for lane in network.lanes.values()])
    return float(known.mean()) if len(known) else 0.0


def with_fields(materials: Mapping[str, Bsdf]) -> dict[str, Bsdf]:
    """Return the materials with grounds of grass parted into fields.

    Args:
        materials: `GroundParts.materials`.
    """
    return {name: _parted(bsdf) for name, bsdf in materials.items()}


def _parted(bsdf: Bsdf) -> Bsdf:
    """A material whose patchy texture also shows fields; any other as it is."""
    colour = bsdf.get("base_color")
    if not isinstance(colour, Mapping) or not colour.get("patches"):
        return bsdf
    return {**bsdf, "base_color": {**colour, "fields": 1.0}}
