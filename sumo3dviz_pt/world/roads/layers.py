"""Thin layers on the road surface: wear, details, paint and rails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.materials import (
    KERB,
    material_name,
    metres_per_tile,
    planar_uvs,
    shows_wear,
)
from sumo3dviz_pt.model.geometry import UNWORN, Mesh
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.world.rails.tracks import flush_paint
from sumo3dviz_pt.world.roads.graded import Graded
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.markings.lines import Paint
from sumo3dviz_pt.world.roads.markings.markings import (
    decal_meshes,
    graded_paint,
    lifted,
    road_paint,
)
from sumo3dviz_pt.world.roads.markings.symbols import cycle_paint
from sumo3dviz_pt.world.roads.strips import BICYCLES, PAVING, BoundsXY
from sumo3dviz_pt.world.roads.wear.details import is_fast, junction_details, road_details
from sumo3dviz_pt.world.roads.wear.lanes import junction_wear, lane_wear
from sumo3dviz_pt.world.roads.wear.stains import STAINED, stained_mesh


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """A mesh of the road.

    Attributes:
        family: What it is, such as `road/wear`; the beginning of its part's id.
        material: Its material's name.
        mesh: In world coordinates.
    """

    family: str
    material: str
    mesh: Mesh


_WEAR, _DETAILS, _PAINT, _RAILS = 0.002, 0.0035, 0.005, 0.01
"""Heights of the layers above the surface [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Base:
    """What layers lie on.

    Attributes:
        layout: The roads.
        surfaces: Their meshes by surface key.
        worn: Keys of those that show wear.
        near: A point of the network [m] near which texture coordinates are small.
        focus: Box around the camera's path [m], or None.
    """

    layout: RoadLayout
    surfaces: Mapping[str, Mesh]
    worn: frozenset[str]
    near: tuple[float, float]
    focus: BoundsXY | None

    @property
    def below(self) -> list[Mesh]:
        """Meshes of carriageways."""
        return [mesh for key, mesh in self.surfaces.items() if key not in {KERB, PAVING}]

    def laid(self, piece: Graded, surface: str, *, lift: float) -> Mesh:
        """Return a graded piece as a mesh above the road.

        Args:
            piece: On the road.
            surface: Key of the surface whose texture it shows.
            lift: Height above the road [m].
        """
        bare = lifted(
            piece.vertices, piece.faces, layout=self.layout, surface=self.below, lift=lift
        )
        uvs = planar_uvs(piece.vertices, tile=metres_per_tile(surface), near=self.near)
        return Mesh(bare.vertices, bare.faces, bare.normals, uvs, piece.wear)


def make_base(
    layout: RoadLayout,
    surfaces: Mapping[str, Mesh],
    *,
    textured: bool,
    near: tuple[float, float],
    focus: BoundsXY | None,
) -> Base:
    """Return what layers lie on; surfaces that show wear get a wear of their own: none yet.

    Args:
        layout: The roads.
        surfaces: Their meshes by surface key.
        textured: False shows no wear.
        near: A point of the network [m] near which texture coordinates are small.
        focus: Box around the camera's path [m], within which footways show stains; or None.
    """
    worn = frozenset(key for key in surfaces if textured and shows_wear(key))
    own = {key: unworn(mesh) if key in worn else mesh for key, mesh in surfaces.items()}
    own |= {key: stained_mesh(own[key], focus) for key in worn & STAINED}
    return Base(layout, own, worn, near, focus)


def unworn(mesh: Mesh) -> Mesh:
    """Return a mesh that says that nothing is worn."""
    wear = np.tile(UNWORN, (len(mesh.vertices), 1))
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, mesh.uvs, wear)


def road_layers(
    network: Network, settings: RoadSettings, base: Base, *, region: BoundsXY | None
) -> list[Layer]:
    """Build all layers, from the lowest up.

    Args:
        network: Says how fast edges are and where vehicles stop.
        settings: Surface, colour and markings of roads.
        base: What the layers lie on.
        region: Only crossings that touch this box get a zebra [m].
    """
    layout = base.layout
    # Wear and repairs.
    fast = frozenset(key for key in layout.strips if is_fast(network.edges[key]))
    stops = frozenset(c.from_lane for c in network.connections if c.tls or c.state in {"s", "w"})
    graded = [
        ("road/wear", lane_wear(layout, surfaces=base.worn, focus=base.focus, stops=stops), _WEAR),
        ("road/tracks", junction_wear(layout, surfaces=base.worn, focus=base.focus), _WEAR),
        (
            "road/details",
            road_details(layout, surfaces=base.worn, focus=base.focus, fast=fast),
            _DETAILS,
        ),
        ("road/repairs", junction_details(layout, surfaces=base.worn, focus=base.focus), _DETAILS),
    ]
    layers = [
        Layer(family, material_name(key), base.laid(piece, key, lift=lift))
        for family, pieces, lift in graded
        for key, piece in pieces.items()
        if len(piece.faces)
    ]
    # Paint, worn where the surface shows wear and of constant colours elsewhere.
    paint = partial(road_paint, network, settings, layout, region=region)
    if settings.surface in base.worn and not settings.colour:
        piece = graded_paint("roads", paint, layout, focus=base.focus)
        key = settings.surface
        mesh = base.laid(piece, key, lift=_PAINT)
        layers.append(Layer("markings", material_name(key), mesh))
    else:
        layers += _plain("markings", paint(), base, _PAINT)
    for surface in (key for key in BICYCLES if key in base.surfaces):
        cycles = partial(cycle_paint, layout.strips, surface)
        if surface in base.worn:
            piece = graded_paint(f"cycles/{surface}", cycles, layout, focus=base.focus)
            mesh = base.laid(piece, surface, lift=_PAINT)
            layers.append(Layer("markings", material_name(surface), mesh))
        else:
            layers += _plain("markings/cycles", cycles(), base, _PAINT)
    # Rails in streets, whichever edge their surface belongs to.
    return layers + _plain("rails", flush_paint(layout), base, _RAILS, own_surface=False)


def _plain(
    family: str, paint: Sequence[Paint], base: Base, lift: float, *, own_surface: bool = True
) -> list[Layer]:
    """A layer of constant colours."""
    meshes = decal_meshes(
        paint, base.layout, surface=base.below, lift=lift, own_surface=own_surface
    )
    return [Layer(family, name, mesh) for name, mesh in meshes.items()]
