"""Proposes a scene file for a simulation: files, cameras, a vehicle to ride in, shots."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.job.meanings import default, meaning
from sumo3dviz_pt.job.settings import ScenarioSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scenario import LogChoices, Scenario, ScenarioFiles
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.pipeline.guessed_types import guess_notes, type_lines
from sumo3dviz_pt.pipeline.schema import LINE
from sumo3dviz_pt.pipeline.stills.still import check_writable

_SHOT = 10.0
"""Length of the proposed shots [s]."""

_RIDES = frozenset({"passenger", "taxi", "evehicle", "hov", "private", "custom1", "custom2"})
"""vClasses whose drivers' view is proposed."""


@dataclass(frozen=True, slots=True, eq=False)
class _Proposal:
    """What is worth looking at.

    Attributes:
        start: First time of the proposed shots [s].
        end: Time after their last frame [s].
        eye: Place of the standing camera, (3,) [m].
        target: What it looks at, (3,) [m].
        vehicle: Id of a vehicle to ride in, or None.
    """

    start: float
    end: float
    eye: Floats
    target: Floats
    vehicle: str | None


def propose(
    scenario: Path,
    *,
    output: Path,
    template: str,
    own: ScenarioSettings | None = None,
) -> tuple[str, list[str]]:
    """Write a commented scene file for a simulation.

    Args:
        scenario: A .sumocfg or a folder.
        output: Where the scene file will lie; paths in it are relative to that.
        template: A scene template's name.
        own: Network, trajectories and signals instead of those found, and additional
            files beside them.

    Returns:
        The text, and notes for the user.

    Raises:
        InputError: If network or trajectories are missing or damaged.
        ConfigError: If the template or the output's folder does not exist.
    """
    from sumo3dviz_pt.sumo import find_scenario, read_scenario, with_use

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
    proposal = _proposal(content)
    notes = [f"missing, and done without: {path}" for path in files.missing]
    notes += guess_notes(content.guesses)
    text = _text(
        files,
        content,
        proposal,
        output=output,
        template=template,
        misfit=own.allow_misfit,
    )
    return text, notes


def _proposal(scenario: Scenario) -> _Proposal:
    """Find the busiest time and place, and a vehicle that drives there."""
    traces = [trace for trace in scenario.traffic.traces if trace.kind == "vehicle"]
    traces = traces or list(scenario.traffic.traces)
    if not traces:
        raise InputError("the vehicle log has steps but no traffic; there is nothing to film")
    begin, end = scenario.traffic.begin, scenario.traffic.end
    start = begin + max(0.0, 0.5 * (end - begin - _SHOT))
    end = min(end, start + _SHOT)
    eye, target = _overview(traces, 0.5 * (start + end))
    rider = _rider(traces, scenario, start, end, target)
    return _Proposal(start, end, eye, target, rider)


def _overview(traces: Sequence[Trace], time: float) -> tuple[Floats, Floats]:
    """Return eye and target of a camera above the busiest 60 m, facing the traffic, (3,) [m]."""
    here = [trace for trace in traces if trace.times[0] <= time <= trace.times[-1]]
    here = here or list(traces)
    rows = [int(np.argmin(np.abs(trace.times - time))) for trace in here]
    places = np.array([trace.positions[row] for trace, row in zip(here, rows, strict=True)])
    yaws = np.array([trace.yaws[row] for trace, row in zip(here, rows, strict=True)])
    # The busiest place is that with the most others within 60 m.
    distance = np.linalg.norm(places[:, None, :2] - places[None, :, :2], axis=-1)
    busiest = int(np.argmax((distance < 60).sum(axis=1)))
    target = places[busiest]
    # Looking against the traffic shows the fronts of vehicles.
    yaw = yaws[busiest]
    ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    aside = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    eye = target + 38.0 * ahead + 9.0 * aside + np.array([0.0, 0.0, 11.0])
    return eye, target + np.array([0.0, 0.0, 1.0])


def _rider(
    traces: Sequence[Trace], scenario: Scenario, start: float, end: float, target: Floats
) -> str | None:
    """Return the car to ride in, or None: one that drives far, and near the target.

    Args:
        traces: All vehicles of the log.
        scenario: For their types.
        start: First time of the shot, all of which the car must last [s].
        end: Time after its last frame [s].
        target: What the standing camera looks at, (3,) [m].
    """
    best: tuple[float, str] | None = None
    for trace in traces:
        kind = scenario.vehicle_types.get(trace.type_id)
        if kind is None or kind.vclass not in _RIDES:
            continue
        inside = (trace.times >= start - 1e-6) & (trace.times <= end + 1e-6)
        if inside.sum() < 2 or trace.times[0] > start or trace.times[-1] < end:
            continue
        path = trace.positions[inside]
        steps = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1)
        near = float(np.linalg.norm(path[:, :2] - target[:2], axis=1).min())
        score = float(steps.sum()) - 0.2 * near
        if best is None or score > best[0]:
            best = (score, trace.id)
    return None if best is None else best[1]


def _text(
    files: ScenarioFiles,
    scenario: Scenario,
    proposal: _Proposal,
    *,
    output: Path,
    template: str,
    misfit: bool,
) -> str:
    """Return the scene file."""
    traffic = scenario.traffic
    lines = [
        LINE,
        "# A scene for sumo3dviz-pt. Every key but `scenario` and `cameras` may go.",
        f"# The log runs from {traffic.begin:g} to {traffic.end:g} s,"
        f" a step every {traffic.step:g} s.",
        "scenario:",
        *_scenario_lines(files, output.parent),
        *(["  allow_misfit: true"] if misfit else []),
        f"template: {template}           # one of {', '.join(catalog.template_names('scene'))}",
        f"seed: 1                         # {meaning('seed')}",
        f"quality: {default('quality')}               # one of"
        f" {', '.join(catalog.template_names('quality'))}",
        "# sky: {preset: sky_blue}       # or:",
        '# sky: {sun: {date: 2026-06-21, time: "17:30", place: [52.5, 13.4]}}',
        "# ground: {texture: ground_grass}",
        *type_lines(scenario.guesses),
        "cameras:",
        "  overview:",
        "    mode: eulerian",
        f"    position: {_point(proposal.eye)}",
        f"    look_at: {_point(proposal.target)}",
        "    lens: {fov: 60}",
        *_ride_lines(proposal),
        *_flight_lines(proposal),
        "shots:",
        *_shot_lines(proposal),
        f"output: {{size: {list(default('output.size'))}, fps: {default('output.fps')}}}",
    ]
    return "\n".join(lines) + "\n"


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


def _point(point: Floats) -> str:
    """Return a point as YAML."""
    return "[" + ", ".join(f"{value:.2f}" for value in point) + "]"


def _ride_lines(proposal: _Proposal) -> list[str]:
    """Return the cameras that ride with the proposed vehicle."""
    if proposal.vehicle is None:
        return []
    name = '"' + proposal.vehicle.replace("\\", "\\\\").replace('"', '\\"') + '"'
    views = ", ".join(catalog.template_names("camera"))
    return [
        f"  driver:                       # other views: {views}",
        f"    {{mode: lagrangian, vehicle: {name}, view: driver}}",
        "  chase:",
        f"    {{mode: lagrangian, vehicle: {name}, view: chase}}",
    ]


def _flight_lines(proposal: _Proposal) -> list[str]:
    """Return a gentle descent towards the busiest place."""
    away = proposal.eye - proposal.target
    far = proposal.target + away * [1.8, 1.8, 2.6]
    middle = 0.5 * (proposal.start + proposal.end)
    keys = (
        (proposal.start, far),
        (middle, proposal.eye),
        (proposal.end, proposal.eye + 6.0 * np.eye(3)[2]),
    )
    return [
        "  flight:",
        "    mode: cinematic",
        "    lens: {fov: 60}",
        "    keyframes:",
        *(
            f"      - {{time: {time:g}, position: {_point(eye)},"
            f" look_at: {_point(proposal.target)}}}"
            for time, eye in keys
        ),
    ]


def _shot_lines(proposal: _Proposal) -> list[str]:
    """Return one shot for each camera."""
    cameras = ["overview", *(["driver"] if proposal.vehicle else []), "flight"]
    return [
        f"  - {{camera: {camera}, from: {proposal.start:g}, to: {proposal.end:g}}}"
        for camera in cameras
    ]
