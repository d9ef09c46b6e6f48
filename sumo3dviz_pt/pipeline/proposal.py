"""Proposes a scene file for a simulation: files, template, cameras, vehicles to ride in, shots."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.job.settings import ScenarioSettings
from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.model.scenario import LogChoices, Scenario
from sumo3dviz_pt.pipeline.guessed_types import guess_notes
from sumo3dviz_pt.pipeline.proposals.busiest import busiest
from sumo3dviz_pt.pipeline.proposals.meetings import apart, meetings_of, riding_apart
from sumo3dviz_pt.pipeline.proposals.movement import movement_of
from sumo3dviz_pt.pipeline.proposals.outdoors import outdoors
from sumo3dviz_pt.pipeline.proposals.rides import choose_rides
from sumo3dviz_pt.pipeline.proposals.templates import ChosenTemplate, choose_template
from sumo3dviz_pt.pipeline.proposals.text import Proposal, in_files, scene_text
from sumo3dviz_pt.pipeline.proposals.views import (
    SHORTEST_FLIGHT,
    Scouting,
    corner,
    flight,
    overview,
)
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.pipeline.stills.still import check_writable

SHOT = 10.0
"""Length of the proposed shots [s]; that of the log if it is shorter."""

_NEAR = 150.0  # who is farther than this from the place plays no part [m]


def propose(
    scenario: Path,
    *,
    output: Path,
    template: str | None = None,
    own: ScenarioSettings | None = None,
) -> tuple[str, list[str]]:
    """Write a commented scene file for a simulation.

    Args:
        scenario: A .sumocfg or a folder.
        output: Where the scene file will lie; paths in it are relative to that.
        template: A scene template's name; None chooses one by the roads.
        own: Network, trajectories and signals instead of those found, and additional
            files beside them.

    Returns:
        The text, and notes for the user.

    Raises:
        InputError: If network or trajectories are missing or damaged.
        ConfigError: If the template or the output's folder does not exist.
    """
    from sumo3dviz_pt.pipeline.motion.lawful import lawfulness_of
    from sumo3dviz_pt.sumo import find_scenario, read_scenario, with_use

    announce(Doing.READ)
    if template is not None:
        catalog.template("scene", template)
    check_writable(output)
    own = own or ScenarioSettings()
    files = find_scenario(scenario, network=own.network, trajectories=own.trajectories)
    files = replace(
        files,
        signals=own.signals or files.signals,
        additional=files.additional + own.additional,
    )
    # Scene files read types from additional files, too.
    typed = replace(files, vehicle_types=files.vehicle_types + files.additional)
    content = with_use(read_scenario(typed, choices=LogChoices(own.allow_misfit)))
    announce(Doing.SCOUT)
    proposal = _proposal(content, template)
    # All that the user should know.
    notes = [f"missing, and done without: {path}" for path in files.missing]
    drawn = lawfulness_of(content).text
    notes += [*guess_notes(content.guesses), *([drawn] if drawn else []), *_notes(proposal)]
    text = scene_text(files, content, proposal, output=output, misfit=own.allow_misfit)
    return text, notes


def _proposal(scenario: Scenario, template: str | None) -> Proposal:
    """Choose template, moment, place, cameras and vehicles to ride in."""
    from sumo3dviz_pt.world.sky.build import build_sky

    traffic, network = scenario.traffic, scenario.network
    if not traffic.traces:
        raise InputError("the vehicle log has steps but no traffic; there is nothing to film")
    meetings = meetings_of(network)
    movement = movement_of(traffic.traces)
    found = busiest(
        apart(movement, meetings), network, span=(traffic.begin, traffic.end), length=SHOT
    )
    look = ChosenTemplate(template, "as asked for") if template else None
    look = look or choose_template(network, found.place, scenario.polygons)
    # Scout the place for cameras.
    there = movement.during(found.start, found.end).near(found.place, _NEAR)
    job = make_job({"scenario": {}, "template": look.name})
    around = outdoors(scenario, found.place, there, textured=job.textured)
    sun = build_sky(job.sky, location=network.location).sun_direction
    scouting = Scouting(found, there, around, sun, scenario.vehicle_types, meetings)
    riders = riding_apart(traffic.traces, meetings)
    rides, unmet = choose_rides(riders, scenario.vehicle_types, found)
    if not riders:
        unmet.append("no camera rides: everyone drives where roads cross without a junction")
    proposal = Proposal(
        found,
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
    found, look = proposal.found, proposal.template
    notes = [f"template {look.name}: {look.why}"]
    if found.movers:
        where = f"junction {found.junction}" if found.junction else "the place"
        notes.append(
            f"most moves from {found.start:.12g} to {found.end:.12g} s at {where}"
            f" ({found.place[0]:.0f}, {found.place[1]:.0f}): {found.movers} road users"
        )
    else:
        notes.append("nobody in this log moves; the cameras look at somebody who stands")
    notes += [f"camera {ride.camera} rides with {ride.vehicle}" for ride in proposal.rides]
    if proposal.corner is None:
        notes.append(
            "no camera `corner`: there is no room for an eye beside the road, sun behind it"
        )
    if proposal.flight is None:
        short = found.end - found.start < SHORTEST_FLIGHT
        why = "every way around the place leads through something"
        notes.append(f"no camera `flight`: {'the moment is too short' if short else why}")
    return [*notes, *proposal.unmet]
