"""Proposes a scene file for a simulation, with comments that say why.

It holds files, template, cameras, vehicles to ride in, and shots.

The template is chosen by the roads around a place, and what stands there. A limit alone tells
little: SUMO's type map for OpenStreetMap gives roads of which it knows none 100 km/h (27.78 m/s).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import shapely

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.job.settings import ScenarioSettings, default, meaning
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Edge, Location, Network
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.model.traffic import (
    LandFiles,
    LogChoices,
    MadeOfTable,
    Polygon,
    Scenario,
    ScenarioFiles,
)
from sumo3dviz_pt.pipeline.reading import guess_notes, type_lines
from sumo3dviz_pt.pipeline.scene_file import LINE, make_job
from sumo3dviz_pt.pipeline.still import check_writable
from sumo3dviz_pt.proposals.busiest import Busiest, ProposedRide, busiest, choose_rides, movement_of
from sumo3dviz_pt.proposals.eyes import apart, meetings_of, riding_apart
from sumo3dviz_pt.proposals.outdoors import outdoors
from sumo3dviz_pt.proposals.views import (
    SEED,
    SHORTEST_FLIGHT,
    Flight,
    Scouting,
    StandingEye,
    corner,
    flight,
    overview,
)
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.town.layout import lacks_town

REACH = 500.0
"""Roads within this distance of a place decide [m]."""

MOTORWAY, CITY, VILLAGE = "highway_day", "city_day", "village_day"
"""The templates that can be chosen."""

_FAST = 75.0 / 3.6  # limit from which a road leads over land [m/s]
_MOTORWAYS = 105.0 / 3.6  # limit from which it is no street [m/s]
_MOST_LOCAL = 12_000.0  # metres of lanes within reach from which a place is a town
_CARS = frozenset({"passenger", "bus", "delivery", "truck"})
_WIDE = 2  # lanes of a direction from which a road is a city's
_WIDE_SHARE = 0.15
_WALKED = 0.25  # share of lanes with footways from which people walk there
_CLOSE = 150.0  # distance of junctions in a town, at most [m]
_WALKERS = frozenset({"pedestrian"})


@dataclass(frozen=True, slots=True)
class ChosenTemplate:
    """A template and the reason for it.

    Attributes:
        name: Of `scene_templates/scene`.
        why: End of a sentence.
    """

    name: str
    why: str


def choose_template(
    network: Network, place: Floats, polygons: Sequence[Polygon] = ()
) -> ChosenTemplate:
    """Return the template that suits the roads around a place, (2,) or (3,) [m].

    Args:
        network: The road network.
        place: What the cameras look at.
        polygons: The scenario's; buildings among them tell of a town.
    """
    edges = [edge for edge in network.edges.values() if _is_road(edge)]
    if not edges:
        return ChosenTemplate(VILLAGE, "no cars drive here")
    lines = np.array([shapely.LineString(edge.lanes[0].shape[:, :2]) for edge in edges])
    away = shapely.distance(lines, shapely.Point(place[:2]))
    near = [edge for edge, far in zip(edges, away, strict=True) if far < REACH] or edges
    town = _town(network, near, place, polygons)
    motorway = _motorway(near, town)
    if motorway is not None:
        return motorway
    if town.lights:
        some = "a traffic light" if town.lights == 1 else f"{town.lights} traffic lights"
        return ChosenTemplate(CITY, f"streets with {some} nearby")
    total = town.metres
    wide = sum(lane.length for edge in near if _width(edge) >= _WIDE for lane in edge.lanes)
    if wide > _WIDE_SHARE * total:
        return ChosenTemplate(
            CITY, f"{100 * wide / total:.0f} % of the lanes belong to wide streets"
        )
    if total > _MOST_LOCAL:
        return ChosenTemplate(CITY, f"{total / 1000:.0f} km of slow lanes nearby")
    return ChosenTemplate(VILLAGE, "few, slow and narrow roads without traffic lights nearby")


@dataclass(frozen=True, slots=True)
class _Town:
    """What tells a town from open land.

    Attributes:
        metres: Of lanes.
        walked: Share of them with a footway or a crossing beside them.
        lights: Number of traffic lights.
        spacing: Usual distance between junctions at which roads meet [m].
        houses: Number of buildings.
    """

    metres: float
    walked: float
    lights: int
    spacing: float
    houses: int

    @property
    def signs(self) -> list[str]:
        """What speaks for a town, in words."""
        signs = []
        if self.walked > _WALKED:
            signs.append(f"{100 * self.walked:.0f} % of the lanes have footways")
        if self.lights:
            signs.append("there are traffic lights")
        if self.spacing < _CLOSE:
            signs.append(f"junctions are {self.spacing:.0f} m apart")
        if self.houses:
            signs.append("there are buildings")
        return signs


def _town(
    network: Network, near: Sequence[Edge], place: Floats, polygons: Sequence[Polygon]
) -> _Town:
    """Return what the edges near a place, and what stands there, tell of a town."""
    metres = {edge.id: sum(lane.length for lane in edge.lanes) for edge in near}
    crossed = {
        name
        for edge in network.edges.values()
        if edge.function == "crossing"
        for name in edge.crossed_edges
    }
    total = max(sum(metres.values()), 1e-9)
    walked = sum(metres[edge.id] for edge in near if edge.id in crossed or _has_footway(edge))
    lights = {
        link.tls
        for link in network.connections
        if link.tls and link.from_lane.rpartition("_")[0] in metres
    }
    arms: dict[str, set[str]] = {}
    for edge in near:
        arms.setdefault(edge.from_junction, set()).add(edge.to_junction)
        arms.setdefault(edge.to_junction, set()).add(edge.from_junction)
    meet = [edge for edge in near if len(arms[edge.from_junction]) > 2]
    meet = [edge for edge in meet if len(arms[edge.to_junction]) > 2]
    spacing = float(np.median([edge.lanes[0].length for edge in meet])) if meet else np.inf
    return _Town(total, walked / total, len(lights), spacing, _houses(polygons, place))


def _motorway(near: Sequence[Edge], town: _Town) -> ChosenTemplate | None:
    """Return the motorway's template if most lanes are fast, and no town says otherwise."""
    named = sum(lane.length for edge in near if _is_named(edge) for lane in edge.lanes)
    fast = sum(lane.length for edge in near if _is_fast(edge) for lane in edge.lanes)
    if fast <= 0.5 * town.metres:
        return None
    # One of these stands beside a motorway, too; a name says what a limit only hints at.
    if named <= 0.5 * town.metres and len(town.signs) > 1:
        return None
    return ChosenTemplate(
        MOTORWAY,
        f"{100 * fast / town.metres:.0f} % of the lanes nearby are motorways or faster than"
        " 75 km/h",
    )


def _is_road(edge: Edge) -> bool:
    """Whether cars drive on an edge between junctions."""
    return edge.function == "normal" and any(lane.allowed & _CARS for lane in edge.lanes)


def _is_named(edge: Edge) -> bool:
    """Whether a map calls an edge a motorway or something alike, or its limit can mean no other."""
    return "motorway" in edge.type or "trunk" in edge.type or edge.told_speed > _MOTORWAYS


def _is_fast(edge: Edge) -> bool:
    """Whether an edge is a motorway or a fast road over land."""
    return _is_named(edge) or (edge.told_speed > _FAST and not _has_footway(edge))


def _has_footway(edge: Edge) -> bool:
    """Whether a lane of an edge is for people on foot alone."""
    return any(lane.allowed == _WALKERS for lane in edge.lanes)


def _houses(polygons: Sequence[Polygon], place: Floats) -> int:
    """Number of buildings within reach of a place."""
    return sum(
        1
        for item in polygons
        if kind_of(item.type, item.source) == "buildings"
        and float(np.hypot(*(item.shape[:, :2] - place[:2]).T).min(initial=np.inf)) < REACH
    )


def _width(edge: Edge) -> int:
    """Number of lanes that cars may use."""
    return sum(1 for lane in edge.lanes if lane.allowed & _CARS)


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """What is worth looking at, and how.

    Attributes:
        spot: The moment and the place.
        template: The look, and why.
        overview: From above.
        corner: At the height of people, or None.
        flight: A descent, or None.
        rides: With road users.
        unmet: Why kinds of road users have no ride.
    """

    spot: Busiest
    template: ChosenTemplate
    overview: StandingEye
    corner: StandingEye | None = None
    flight: Flight | None = None
    rides: tuple[ProposedRide, ...] = ()
    unmet: tuple[str, ...] = ()


def in_files(proposal: Proposal, location: Location) -> Proposal:
    """Return a proposal in SUMO's coordinates, as scene files have them."""

    def outside(places: Floats) -> Floats:
        return location.outside(np.round(places, 2))

    def stood(stand: StandingEye) -> StandingEye:
        return replace(stand, eye=outside(stand.eye), aim=outside(stand.aim))

    flight = proposal.flight
    return replace(
        proposal,
        spot=replace(proposal.spot, place=outside(proposal.spot.place)),
        overview=stood(proposal.overview),
        corner=proposal.corner and stood(proposal.corner),
        flight=flight and replace(flight, eyes=outside(flight.eyes), aims=outside(flight.aims)),
    )


def scene_text(
    files: ScenarioFiles,
    scenario: Scenario,
    proposal: Proposal,
    *,
    output: Path,
    misfit: bool = False,
    land: LandFiles = LandFiles(),  # noqa: B008 - frozen
) -> str:
    """Return the scene file.

    Args:
        files: Of the simulation.
        scenario: What they hold.
        proposal: The choices.
        output: Where the scene file will lie; paths in it are relative to that.
        misfit: Whether a log that seems wrong is taken.
        land: What tells what the land is like.
    """
    traffic, look = scenario.traffic, proposal.template
    lines = [
        LINE,
        "# A scene for sumo3dviz-pt. Every key but `scenario` and `cameras` may go.",
        f"# The log runs from {traffic.begin:.12g} to {traffic.end:.12g} s,"
        f" a step every {traffic.step:g} s.",
        "scenario:",
        *_scenario_lines(files, output.parent),
        *(["  allow_misfit: true"] if misfit else []),
        f"# Chosen because: {_comment(look.why)}.",
        f"template: {look.name}           # one of {', '.join(catalog.template_names('scene'))}",
        f"seed: {SEED}                         # {meaning('seed')}",
        f"quality: {default('quality')}               # one of"
        f" {', '.join(catalog.template_names('quality'))}",
        "# sky: {preset: sky_blue}       # or:",
        f'# sky: {{sun: {{date: 2026-06-21, time: "17:30", place: {_here(scenario)}}}}}',
        _ground_line(land, output.parent),
        *_town_lines(scenario),
        *type_lines(scenario.guesses),
        *_place_lines(proposal.spot),
        "cameras:",
        *_stand_lines("overview", proposal.overview, "from above"),
        *_stand_lines("corner", proposal.corner, "at the height of people, beside the road"),
        *_ride_lines(proposal.rides),
        *_flight_lines(proposal.flight),
        *_shot_lines(proposal),
        f"output: {{size: {list(default('output.size'))}, fps: {default('output.fps')}}}",
    ]
    return "\n".join(lines) + "\n"


def _ground_line(land: LandFiles, folder: Path) -> str:
    """Say what the land is like."""
    files = {"heights": land.heights, "picture": land.picture}
    said = [f"{key}: {quoted_path(file, folder)}" for key, file in files.items() if file]
    return f"ground: {{{', '.join(said)}}}" if said else "# ground: {texture: ground_grass}"


def _town_lines(scenario: Scenario) -> list[str]:
    """Ask for a town where a scenario brings none."""
    if not lacks_town(scenario):
        return []
    if scenario.network.picture is not None:
        return ["# street: {town: auto}          # would put invented houses on the picture"]
    return [
        "# The scenario has hardly any houses: a town is invented, by what the roads tell of it.",
        "street: {town: auto}            # or none",
    ]


def _here(scenario: Scenario) -> str:
    """Return the network's latitude and longitude as YAML, or Berlin's where it has none."""
    latitude, longitude = scenario.network.location.place or (52.5, 13.4)
    return f"[{latitude:.6g}, {longitude:.6g}]"


def _scenario_lines(files: ScenarioFiles, folder: Path) -> list[str]:
    """Return the files, relative to the scene file."""
    quoted = partial(quoted_path, folder=folder)
    made = {file for each in files.tables for file in each.files}
    lines = [] if files.network in made else [f"  network: {quoted(files.network)}"]
    for each in files.tables:
        lines += _table_lines(each, quoted(each.table))
    for key in ("trajectories", "signals", "additional", "vehicle_types"):
        paths = tuple(path for path in getattr(files, key) if path not in made)
        if paths:
            lines += [f"  {key}:", *(f"    - {quoted(path)}" for path in paths)]
    return lines


def quoted_path(path: Path, folder: Path) -> str:
    """Return a path as YAML, relative to a folder."""
    try:
        text = Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive on Windows
        text = path.resolve().as_posix()
    return '"' + text.replace("\\", "/").replace('"', '\\"') + '"'


def _table_lines(made: MadeOfTable, file: str) -> list[str]:
    """Return a table of trajectories and how it was understood.

    Args:
        made: The table.
        file: Its path as YAML.
    """
    if made.told:
        return [f"  trajectories: {file}"]
    choices = made.choices
    lines = ["  trajectories:", f"    file: {file}", "    columns:  # correct what is wrong"]
    for role, column in choices.columns.items():
        more = [
            f"{key}: {value}"
            for key, value in (("unit", column.unit), ("zero", column.zero), ("turn", column.turn))
            if value
        ]
        name = '"' + column.name.replace("\\", "\\\\").replace('"', '\\"') + '"'
        lines.append(f"      {role}: {{{', '.join([f'column: {name}', *more])}}}")
    lines.append(f"    point: {choices.point}  # of the body; or front, centre, rear")
    if "frame" in choices.columns:
        lines.append(f"    rate: {choices.rate:g}  # frames in a second")
    return lines


def _place_lines(spot: Busiest) -> list[str]:
    """Say in a comment where the cameras look, and why."""
    x, y = spot.place[:2]
    where = f"junction {_comment(spot.junction)}" if spot.junction else "a road"
    return [
        f"# Most moves from {spot.start:.12g} to {spot.end:.12g} s at {where} ({x:.0f}, {y:.0f}):"
        f" {spot.movers} road users."
    ]


def _comment(text: str) -> str:
    """Return text that ends no comment: ids may hold anything."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _point(point: Floats) -> str:
    """Return a point as YAML."""
    return "[" + ", ".join(f"{value:.2f}" for value in point) + "]"


def _stand_lines(name: str, stand: StandingEye | None, what: str) -> list[str]:
    """Return a camera that stands."""
    if stand is None:
        return []
    return [
        f"  {name}:".ljust(32) + f"# {what}",
        "    mode: eulerian",
        f"    position: {_point(stand.eye)}",
        f"    look_at: {_point(stand.aim)}",
        f"    lens: {{fov: {stand.fov:g}}}",
    ]


def _ride_lines(rides: tuple[ProposedRide, ...]) -> list[str]:
    """Return the cameras that ride, and a second view of the first car."""
    views = ", ".join(catalog.template_names("camera"))
    lines = []
    for ride in rides:
        name = '"' + ride.vehicle.replace("\\", "\\\\").replace('"', '\\"') + '"'
        what = f"other views: {views}" if ride is rides[0] else f"{ride.metres:.0f} m in its shot"
        cameras = [(ride.camera, ride.view)]
        if ride.view == "driver":
            cameras.append(("chase", "chase"))
        for camera, view in cameras:
            lines += [
                f"  {camera}:".ljust(32) + f"# {what}" if camera == ride.camera else f"  {camera}:",
                f"    {{mode: lagrangian, vehicle: {name}, view: {view}}}",
            ]
    return lines


def _flight_lines(flight: Flight | None) -> list[str]:
    """Return a camera that flies."""
    if flight is None:
        return []
    return [
        "  flight:".ljust(32) + "# a gentle descent",
        "    mode: cinematic",
        f"    lens: {{fov: {flight.fov:g}}}",
        "    keyframes:",
        *(
            f"      - {{time: {time:.12g}, position: {_point(eye)}, look_at: {_point(aim)}}}"
            for time, eye, aim in zip(
                np.round(flight.times, 3).tolist(), flight.eyes, flight.aims, strict=True
            )
        ),
    ]


def _shot_lines(proposal: Proposal) -> list[str]:
    """Return one shot for each camera; a film needs more than one moment."""
    spot = proposal.spot
    if spot.start == spot.end:
        return ["shots: []                       # the log is one moment: `still` shows it"]
    windows = [("overview", spot.start, spot.end)]
    if proposal.corner is not None:
        windows.append(("corner", spot.start, spot.end))
    windows += [(ride.camera, ride.start, ride.end) for ride in proposal.rides]
    if proposal.flight is not None:
        windows.append(("flight", spot.start, spot.end))
    lines = [f"  - {{camera: {name}, from: {a:.12g}, to: {b:.12g}}}" for name, a, b in windows]
    return ["shots:", *lines]


SHOT = 10.0
"""Length of the proposed shots [s]; that of the log if it is shorter."""

_NEAR = 150.0  # who is farther than this from the place plays no part [m]


def propose(
    scenario: Path,
    *,
    output: Path,
    template: str | None = None,
    own: ScenarioSettings | None = None,
    heights: Path | None = None,
) -> tuple[str, list[str]]:
    """Write a commented scene file for a simulation.

    Args:
        scenario: A .sumocfg or a folder.
        output: Where the scene file will lie; paths in it are relative to that.
        template: A scene template's name; None chooses one by the roads.
        own: Network, trajectories and signals instead of those found, and additional
            files beside them.
        heights: The land's, if they are to be used.

    Returns:
        The text, and notes for the user.

    Raises:
        InputError: If network or trajectories are missing or damaged.
        ConfigError: If the template or the output's folder does not exist.
    """
    from sumo3dviz_pt.motion.breaches import lawfulness_of
    from sumo3dviz_pt.sumo import find_scenario, read_scenario, with_use
    from sumo3dviz_pt.sumo.land.pictures import pictures_beside, view_with_picture

    announce(Doing.READ)
    if template is not None:
        catalog.template("scene", template)
    check_writable(output)
    own = own or ScenarioSettings()
    files = find_scenario(scenario, network=own.network, trajectories=own.logs, table=own.table)
    files = replace(
        files,
        signals=own.signals or files.signals,
        additional=files.additional + own.additional,
    )
    # Scene files read types from additional files, too.
    typed = replace(files, vehicle_types=files.vehicle_types + files.additional)
    land = LandFiles(heights, view_with_picture(scenario))
    choices = LogChoices(own.allow_misfit, land=land)
    content = with_use(read_scenario(typed, choices=choices))
    announce(Doing.SCOUT)
    proposal = _proposal(content, template)
    # All that the user should know.
    notes = [f"missing, and done without: {path}" for path in files.missing]
    drawn = lawfulness_of(content).text
    for file in () if land.picture else pictures_beside(scenario):
        notes.append(f"ground: {{picture: {file.name}}} would lay that picture on the land")
    notes += [*guess_notes(content.guesses), *([drawn] if drawn else []), *_notes(proposal)]
    text = scene_text(files, content, proposal, output=output, misfit=own.allow_misfit, land=land)
    return text, notes


def _proposal(scenario: Scenario, template: str | None) -> Proposal:
    """Choose template, moment, place, cameras and vehicles to ride in."""
    from sumo3dviz_pt.world.sky import build_sky

    traffic, network = scenario.traffic, scenario.network
    if not traffic.traces:
        raise InputError("the vehicle log has steps but no traffic; there is nothing to film")
    meetings = meetings_of(network)
    movement = movement_of(traffic.traces)
    spot = busiest(
        apart(movement, meetings), network, span=(traffic.begin, traffic.end), length=SHOT
    )
    look = ChosenTemplate(template, "as asked for") if template else None
    look = look or choose_template(network, spot.place, scenario.polygons)
    # Scout the place for cameras.
    there = movement.during(spot.start, spot.end).near(spot.place, _NEAR)
    job = make_job({"scenario": {}, "template": look.name})
    around = outdoors(scenario, spot.place, there, textured=job.textured)
    sun = build_sky(job.sky, location=network.location).sun_direction
    scouting = Scouting(spot, there, around, sun, scenario.vehicle_types, meetings)
    riders = riding_apart(traffic.traces, meetings)
    rides, unmet = choose_rides(riders, scenario.vehicle_types, spot, step=traffic.step)
    if not riders:
        unmet.append("no camera rides: everyone drives where roads cross without a junction")
    proposal = Proposal(
        spot,
        look,
        overview=overview(scouting),
        corner=corner(scouting),
        flight=flight(scouting),
        rides=tuple(rides),
        unmet=tuple(unmet),
    )
    return in_files(proposal, network.location)


def _notes(proposal: Proposal) -> list[str]:
    """Say what was chosen and why, and what could not be proposed."""
    spot, look = proposal.spot, proposal.template
    notes = [f"template {look.name}: {look.why}"]
    if spot.movers:
        where = f"junction {spot.junction}" if spot.junction else "the place"
        notes.append(
            f"most moves from {spot.start:.12g} to {spot.end:.12g} s at {where}"
            f" ({spot.place[0]:.0f}, {spot.place[1]:.0f}): {spot.movers} road users"
        )
    else:
        notes.append("nobody in this log moves; the cameras look at somebody who stands")
    notes += [f"camera {ride.camera} rides with {ride.vehicle}" for ride in proposal.rides]
    if proposal.corner is None:
        notes.append(
            "no camera `corner`: there is no room for an eye beside the road, sun behind it"
        )
    if proposal.flight is None:
        short = spot.end - spot.start < SHORTEST_FLIGHT
        why = "every way around the place leads through something"
        notes.append(f"no camera `flight`: {'the moment is too short' if short else why}")
    return [*notes, *proposal.unmet]
