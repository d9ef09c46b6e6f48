"""Writes a proposed scene file, with comments that say why."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.meanings import default, meaning
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.scenario import Scenario, ScenarioFiles
from sumo3dviz_pt.pipeline.guessed_types import type_lines
from sumo3dviz_pt.pipeline.proposals.busiest import Busiest
from sumo3dviz_pt.pipeline.proposals.rides import Ride
from sumo3dviz_pt.pipeline.proposals.templates import ChosenTemplate
from sumo3dviz_pt.pipeline.proposals.views import SEED, Flight, Stand
from sumo3dviz_pt.pipeline.schema import LINE


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """What is worth looking at, and how.

    Attributes:
        found: The moment and the place.
        template: The look, and why.
        overview: From above.
        corner: At the height of people, or None.
        flight: A descent, or None.
        rides: With road users.
        unmet: Why kinds of road users have no ride.
    """

    found: Busiest
    template: ChosenTemplate
    overview: Stand
    corner: Stand | None = None
    flight: Flight | None = None
    rides: tuple[Ride, ...] = ()
    unmet: tuple[str, ...] = ()


def in_files(proposal: Proposal, location: Location) -> Proposal:
    """Return a proposal in SUMO's coordinates, as scene files have them."""

    def said(places: Floats) -> Floats:
        return location.outside(np.round(places, 2))

    def stood(stand: Stand) -> Stand:
        return replace(stand, eye=said(stand.eye), aim=said(stand.aim))

    flight = proposal.flight
    return replace(
        proposal,
        found=replace(proposal.found, place=said(proposal.found.place)),
        overview=stood(proposal.overview),
        corner=proposal.corner and stood(proposal.corner),
        flight=flight and replace(flight, eyes=said(flight.eyes), aims=said(flight.aims)),
    )


def scene_text(
    files: ScenarioFiles,
    scenario: Scenario,
    proposal: Proposal,
    *,
    output: Path,
    misfit: bool = False,
) -> str:
    """Return the scene file.

    Args:
        files: Of the simulation.
        scenario: What they hold.
        proposal: The choices.
        output: Where the scene file will lie; paths in it are relative to that.
        misfit: Whether a log that seems wrong is taken.
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
        "# ground: {texture: ground_grass}",
        *type_lines(scenario.guesses),
        *_place_lines(proposal.found),
        "cameras:",
        *_stand_lines("overview", proposal.overview, "from above"),
        *_stand_lines("corner", proposal.corner, "at the height of people, beside the road"),
        *_ride_lines(proposal.rides),
        *_flight_lines(proposal.flight),
        *_shot_lines(proposal),
        f"output: {{size: {list(default('output.size'))}, fps: {default('output.fps')}}}",
    ]
    return "\n".join(lines) + "\n"


def _here(scenario: Scenario) -> str:
    """Return the network's latitude and longitude as YAML, or Berlin's where it has none."""
    latitude, longitude = scenario.network.location.place or (52.5, 13.4)
    return f"[{latitude:.6g}, {longitude:.6g}]"


def _scenario_lines(files: ScenarioFiles, folder: Path) -> list[str]:
    """Return the files, relative to the scene file."""

    def quoted(path: Path) -> str:
        try:
            text = Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
        except ValueError:  # another drive on Windows
            text = path.resolve().as_posix()
        return '"' + text.replace("\\", "/").replace('"', '\\"') + '"'

    lines = [f"  network: {quoted(files.network)}"]
    for key in ("trajectories", "signals", "additional", "vehicle_types"):
        paths: tuple[Path, ...] = getattr(files, key)
        if paths:
            lines += [f"  {key}:", *(f"    - {quoted(path)}" for path in paths)]
    return lines


def _place_lines(found: Busiest) -> list[str]:
    """Say in a comment where the cameras look, and why."""
    x, y = found.place[:2]
    where = f"junction {_comment(found.junction)}" if found.junction else "a road"
    return [
        f"# Most moves from {found.start:.12g} to {found.end:.12g} s at {where} ({x:.0f}, {y:.0f}):"
        f" {found.movers} road users."
    ]


def _comment(text: str) -> str:
    """Return text that ends no comment: ids may hold anything."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _point(point: Floats) -> str:
    """Return a point as YAML."""
    return "[" + ", ".join(f"{value:.2f}" for value in point) + "]"


def _stand_lines(name: str, stand: Stand | None, what: str) -> list[str]:
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


def _ride_lines(rides: tuple[Ride, ...]) -> list[str]:
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
    found = proposal.found
    if found.start == found.end:
        return ["shots: []                       # the log is one moment: `still` shows it"]
    windows = [("overview", found.start, found.end)]
    if proposal.corner is not None:
        windows.append(("corner", found.start, found.end))
    windows += [(ride.camera, ride.start, ride.end) for ride in proposal.rides]
    if proposal.flight is not None:
        windows.append(("flight", found.start, found.end))
    lines = [f"  - {{camera: {name}, from: {a:.12g}, to: {b:.12g}}}" for name, a, b in windows]
    return ["shots:", *lines]
