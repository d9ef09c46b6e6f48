"""Street lamps, signs and furniture: where they stand, and what they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import StreetSettings
from sumo3dviz_pt.library.street.road_styles import STYLES, SignStyle
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import LampSet, LeftOut, Part, StaticPart
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.world.areas.slabs import SOURCE as SLABS
from sumo3dviz_pt.world.land.ground import GroundParts
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.objects.objects import merged
from sumo3dviz_pt.world.placement.surroundings import (
    HeightAt,
    Surroundings,
    Tile,
    edges_in,
    tiles_seen,
)
from sumo3dviz_pt.world.roads.cells import heights_near
from sumo3dviz_pt.world.roads.roads import RoadParts
from sumo3dviz_pt.world.street.furniture import REACH as FURNITURE_REACH
from sumo3dviz_pt.world.street.furniture import (
    FurnitureItem,
    StopFurniture,
    furniture_parts,
    place_corners,
    place_furniture,
    place_stops,
)
from sumo3dviz_pt.world.street.lamps import (
    REACH,
    Lamp,
    hidden_lamps,
    lamp_parts,
    lamp_sets,
    place_lamps,
)
from sumo3dviz_pt.world.street.places import Border, Site, borders_in, crossing_areas
from sumo3dviz_pt.world.street.signs import (
    GANTRY_REACH,
    EdgeLinks,
    Sign,
    links_of,
    place_exits,
    place_signs,
    sign_parts,
)

_TILE = 250.0  # tiles of street furniture [m]
_BESIDE = 100.0  # what belongs to an edge stands at most this far beyond its ends [m]
_SHADOW = 30.0  # what stands outside a picture may throw a shadow into it [m]

FAMILIES = ("street lamps", "signs", "furniture")
"""What users call the families."""


@dataclass(frozen=True, slots=True, eq=False)
class StreetParts:
    """Street furniture, ready for the scene.

    Attributes:
        static: Few parts per family.
        lamps: What shines by night.
        left_out: What was left out, and why.
    """

    static: tuple[StaticPart, ...] = ()
    lamps: tuple[LampSet, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


def build_street(
    scenario: Scenario,
    settings: StreetSettings,
    *,
    site: Site,
    dark: bool,
    style: SignStyle = STYLES["european"].signs,
) -> StreetParts:
    """Build the street lamps, signs and furniture that the cameras of a shot see.

    Args:
        scenario: Roads, POIs and stops.
        settings: Which of them stand by themselves.
        site: Where things may stand; see `site_of`.
        dark: Whether lamps shine.
        style: What signs look like.
    """
    around, furnished = site.around, _StreetTiles(scenario, settings, site, style)
    # Collect what stands in tiles that a camera sees.
    gates = [furnished.exits(tile) for tile in _tiles(around, GANTRY_REACH)]
    exits = [sign for gate in gates for sign in gate.exits]
    kerbs = [furnished.kerbs(tile) for tile in _tiles(around, REACH)]
    nearest = _tiles(around, 2 * FURNITURE_REACH)
    walks = [furnished.walks(tile) for tile in nearest]
    pieces = [piece for walk in walks for piece in walk.pieces]
    pieces += [piece for tile in nearest for piece in furnished.kerbs(tile).stops.shelters]
    signs = [sign for kerb in kerbs for sign in (*kerb.signs, *kerb.stops.signs)]
    lamps = [lamp for kerb in kerbs for lamp in kerb.lamps]
    # Build it.
    parts: dict[str, Sequence[Part]] = {
        "street lamps": lamp_parts(lamps, around, dark=dark),
        "signs": sign_parts([*exits, *signs], around),
        "furniture": furniture_parts(pieces, around),
    }
    static = [part for family in FAMILIES for part in merged(family, parts[family])]
    cramped = sum(kerb.stops.cramped for kerb in kerbs)
    yielded = any(kerb.yielded for kerb in kerbs) or any(walk.yielded for walk in walks)
    yielded |= any(gate.yielded for gate in gates)
    return StreetParts(
        tuple(static),
        lamp_sets(lamps, around) if dark else (),
        _absent(parts, settings, cramped) + _out_of_sight(scenario, around, yielded=yielded),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Exits:
    """What announces the exits of motorways in one tile, and the posts of that, (n, 2) [m].

    `yielded` says whether some of it makes room for a camera.
    """

    exits: tuple[Sign, ...]
    used: tuple[Floats, ...]
    yielded: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Kerbs:
    """What stands at the kerbs of one tile, and where anything stands, (n, 2) [m].

    `yielded` says whether some of it makes room for a camera.
    """

    stops: StopFurniture
    signs: tuple[Sign, ...]
    lamps: tuple[Lamp, ...]
    used: tuple[Floats, ...]
    yielded: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Walks:
    """What stands on footways and corners of one tile, and whether some makes room for a camera."""

    pieces: tuple[FurnitureItem, ...]
    yielded: bool


@dataclass(frozen=True, slots=True, eq=False)
class _StreetTiles:
    """What stands along streets, tile by tile, whatever looks at it.

    What comes later keeps off what came before: exits, then kerbs, then walks.

    Attributes:
        scenario: Roads, POIs and stops.
        settings: Which of them stand by themselves.
        site: All that is given; what stands does not depend on its cameras.
        style: What signs look like.
    """

    scenario: Scenario
    settings: StreetSettings
    site: Site
    style: SignStyle

    def exits(self, tile: Tile) -> _Exits:
        """Gantries and boards of exits in a tile."""
        return self._memory.of(("street exits", tile), partial(self._exits, tile))

    def kerbs(self, tile: Tile) -> _Kerbs:
        """Stops, signs and lamps in a tile."""
        return self._memory.of(("street kerbs", tile), partial(self._kerbs, tile))

    def walks(self, tile: Tile) -> _Walks:
        """Furniture of footways and corners in a tile."""
        return self._memory.of(("street walks", tile), partial(self._walks, tile))

    def _exits(self, tile: Tile) -> _Exits:
        """What `exits` keeps."""
        site = self._site(tile, ())
        if self.settings.signs != "auto":
            return _Exits((), ())
        network = self.scenario.network
        exits = place_exits(network, self._borders(tile), site, self._links)
        return _Exits(tuple(exits), tuple(site.used), bool(site.yielded))

    def _kerbs(self, tile: Tile) -> _Kerbs:
        """What `kerbs` keeps."""
        site, network = self._site(tile, self.exits(tile).used), self.scenario.network
        borders = self._borders(tile)
        stops = place_stops(network, self.scenario.stops, site)
        auto = self.settings.signs == "auto"
        signs = place_signs(network, borders, site, self._links, self.style) if auto else []
        auto = self.settings.lamps == "auto"
        lamps = place_lamps(borders if auto else [], self.scenario.pois, site)
        used, yielded = tuple(site.used), bool(site.yielded)
        return _Kerbs(stops, tuple(signs), tuple(lamps), used, yielded)

    def _walks(self, tile: Tile) -> _Walks:
        """What `walks` keeps."""
        site, network = self._site(tile, self.kerbs(tile).used), self.scenario.network
        auto = self.settings.furniture == "auto"
        pieces = place_furniture(self._borders(tile), self.scenario.pois, site, auto=auto)
        if auto:
            edges = edges_in(network, tile.box(), self._memory)
            pieces += place_corners(edges, network, site)
        return _Walks(tuple(pieces), bool(site.yielded))

    @property
    def _memory(self) -> Memory:
        """What was built of the world."""
        return self.site.around.memory

    @property
    def _links(self) -> EdgeLinks:
        """Connections of the network."""
        return self._memory.of(("links",), partial(links_of, self.scenario.network))

    def _borders(self, tile: Tile) -> list[Border]:
        """Borders of streets that may come near a tile."""
        return borders_in(self.scenario.network, tile.box(_BESIDE), self._memory)

    def _site(self, tile: Tile, used: Sequence[Floats]) -> Site:
        """The ground of a tile, on which something stands already."""
        return replace(self.site, tile=tile, used=list(used), yielded=[])


def _tiles(around: Surroundings, reach: float) -> list[Tile]:
    """Tiles of street furniture that a camera sees, up to a distance [m]."""
    return tiles_seen(around, size=_TILE, reach=reach, beyond=_SHADOW)


def site_of(
    scenario: Scenario,
    around: Surroundings,
    *,
    roads: RoadParts,
    ground: GroundParts,
    supports: Floats,
) -> Site:
    """Return the ground that street furniture stands on.

    What our own code adds (houses, plants) stands too far from streets to matter here.

    Args:
        scenario: Its trees, houses and fences keep their places.
        around: Lanes, cameras and chance.
        roads: Sidewalks and their height.
        ground: Everything else.
        supports: Feet of signals, (n, 2) [m].
    """
    known = around.memory.of(("street", "given"), partial(_obstacles, scenario))
    taken = np.concatenate([known.taken, supports.reshape(-1, 2)])
    standing = standing_height(roads, ground)
    return Site(around, standing, known.crossings, taken, known.lines)


@dataclass(frozen=True, slots=True, eq=False)
class _Obstacles:
    """What a scenario brings that street furniture keeps off."""

    crossings: shapely.STRtree
    taken: Floats
    lines: shapely.STRtree


def _obstacles(scenario: Scenario) -> _Obstacles:
    """What a scenario brings."""
    trees = [poi.position for poi in scenario.pois if kind_of(poi.type, poi.source) is not None]
    lines = [
        shapely.LineString(item.shape[:, :2])
        for item in scenario.polygons
        if len(item.shape) > 1 and kind_of(item.type, item.source) == "fences"
    ]
    walls = [
        shapely.make_valid(shapely.Polygon(item.shape[:, :2]))
        for item in scenario.polygons
        if len(item.shape) > 2
        and (item.source == SLABS or kind_of(item.type, item.source) == "buildings")
    ]
    return _Obstacles(
        crossing_areas(scenario.network),
        np.array(trees, dtype=np.float64).reshape(-1, 2),
        shapely.STRtree([*lines, *walls]),
    )


def standing_height(roads: RoadParts, ground: GroundParts) -> HeightAt:
    """Return the height of whatever lies on top: sidewalk, road or ground."""
    tree = shapely.STRtree(roads.layout.outline)

    def height_at(places: Floats) -> Floats:
        """Return height at places, (n, 2) -> (n,) [m]."""
        heights = np.array(ground.height_at(places), dtype=np.float64)
        paved = np.unique(tree.query(shapely.points(places), predicate="intersects")[0])
        if len(paved):
            spots = places[paved]
            heights[paved] = heights_near(roads.layout.cells, spots)
            heights[paved] += roads.surface_height_at(spots)
        return heights

    return height_at


def _absent(
    parts: dict[str, Sequence[Part]], settings: StreetSettings, cramped: int
) -> tuple[LeftOut, ...]:
    """Say what is missing and why."""
    keys = {"street lamps": "lamps", "signs": "signs", "furniture": "furniture"}
    left_out = []
    for family, key in keys.items():
        if not parts[family]:
            off = getattr(settings, key) == "none"
            why = f"switched off by `street.{key}`" if off else "no road near the camera has any"
            left_out.append(LeftOut(family, why))
    if cramped:
        left_out.append(LeftOut(f"{cramped} bus shelters", "there is no room beside the stop"))
    return tuple(left_out)


def _out_of_sight(
    scenario: Scenario, around: Surroundings, *, yielded: bool
) -> tuple[LeftOut, ...]:
    """Say what stands elsewhere or not at all as it would stand right before a camera."""
    left_out = []
    if hidden := hidden_lamps(scenario.pois, around):
        why = "they would stand right before a camera; `clear_view: false` keeps them"
        left_out.append(LeftOut(f"{hidden} street lamps of the scenario", why))
    if yielded:
        why = "it was moved or left out; `clear_view: false` keeps it"
        left_out.append(LeftOut("street furniture right before a camera", why))
    return tuple(left_out)
