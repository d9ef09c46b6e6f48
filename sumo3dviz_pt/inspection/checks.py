"""Validates a whole scene and says what it holds, what it leaves out and what it costs.

Shots near each other share what is built of their place.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import shapely

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import CameraSettings, Job, Quality, SoundSettings
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.falling import reflection_samples
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.numbers import counted, in_short
from sumo3dviz_pt.model.scene import LeftOut, SceneData
from sumo3dviz_pt.model.traffic import Scenario, ScenarioFiles
from sumo3dviz_pt.motion import LogMotion
from sumo3dviz_pt.pipeline.accounts import weather_report
from sumo3dviz_pt.pipeline.conditions import conditions_factor, film_cost, sun_report
from sumo3dviz_pt.pipeline.costs import PROCESSOR, space_in_words, time_in_words
from sumo3dviz_pt.pipeline.production import (
    Production,
    Request,
    check_choices,
    check_window,
    frame_times,
    life_of,
    prepare,
)
from sumo3dviz_pt.pipeline.reading import check_rider, motion_of, read_files
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.pipeline.traffic import Survey
from sumo3dviz_pt.pipeline.worlds import world_of
from sumo3dviz_pt.world.outlook import Outlook

_TOGETHER = 150.0
"""Shots whose cameras come closer than this share a place [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Outing:
    """A shot, for which a place is to be built.

    Attributes:
        camera: The camera's name.
        times: Of its frames, (n,) [s].
    """

    camera: str
    times: Floats


def outlooks(
    job: Job, files: ScenarioFiles, scenario: Scenario, motion: LogMotion, outings: Sequence[Outing]
) -> list[Outlook | None]:
    """Return all cameras that share a shot's place, shot by shot; None for one that is alone.

    Args:
        job: The scene file.
        files: The simulation's files.
        scenario: As read, the whole log.
        motion: Of everyone in it.
        outings: The shots.

    Raises:
        ConfigError: If a shot lies outside of the log, or whom its camera rides with is not there.
    """
    if len(outings) < 2:
        return [None] * len(outings)
    ways = [_way(job, files, scenario, motion, outing) for outing in outings]
    plans = [shapely.MultiPoint(way.positions[:, :2]).convex_hull for way in ways]
    groups: list[set[int]] = []
    for number, plan in enumerate(plans):
        near = [g for g in groups if any(shapely.dwithin(plan, plans[k], _TOGETHER) for k in g)]
        groups = [g for g in groups if g not in near] + [{number}.union(*near)]
    views: list[Outlook | None] = [None] * len(outings)
    for group in groups:
        if len(group) > 1:
            joined = Outlook(CameraPath.joined([ways[k] for k in sorted(group)]))
            for k in group:
                views[k] = joined
    return views


def _way(
    job: Job, files: ScenarioFiles, scenario: Scenario, motion: LogMotion, outing: Outing
) -> CameraPath:
    """Return where a shot's camera is and looks."""
    from sumo3dviz_pt.shot.road_users import way_of

    camera, times = job.cameras[outing.camera], outing.times
    check_window(scenario, times)
    riders = motion.smooth(motion.named(getattr(camera, "vehicle", "")))
    logs = files.trajectories
    check_rider(camera, name=outing.camera, times=times, trajectories=riders, logs=logs)
    return way_of(world_of(scenario, job, files), riders, camera=camera, times=times)


TRIANGLE_BUDGET = 1_500_000
"""Unique triangles per shot that keep the update of a frame below half a CPU-second; those of
plants that share models do not count."""

SHARED = "models of plants"
"""What near plants that share models are called."""

MOMENTS = "moments of an open shutter"
"""What a camera without a shutter does without: nothing is moved more than once a frame."""

_LEAST_TOLD = 0.005
"""Savings below this are not told in words [CPU-s]."""


@dataclass(frozen=True, slots=True)
class _Span:
    """What a shot would show, or all that a camera can show where there are no shots.

    Attributes:
        camera: The camera's name.
        start: SUMO's time of the first frame [s].
        end: SUMO's time after the last frame [s].
        speed: SUMO's time per film's.
    """

    camera: str
    start: float
    end: float
    speed: Fraction = Fraction(1)


def check_scene(job: Job, *, presets: Sequence[str] | None = None) -> dict[str, Any]:
    """Build every shot without rendering and report on it; shots near each other share a place.

    Args:
        job: The scene file.
        presets: Names of the presets to forecast the cost of; default all.

    Raises:
        ConfigError: If a setting is wrong.
        InputError: If a file is wrong.
    """
    from sumo3dviz_pt.cast.choice import idle
    from sumo3dviz_pt.motion.breaches import lawfulness

    check_choices(job, Request())
    # Without shots, each camera shows all that it can.
    windows = [_Span(shot.camera, shot.start, shot.end, shot.speed) for shot in job.shots]
    files, scenario = read_files(job)
    motion = motion_of(job, scenario)
    if not windows:
        trajectories = motion.smooth()
        lives = {name: life_of(camera, trajectories) for name, camera in job.cameras.items()}
        windows = [_Span(name, *life) for name, life in lives.items()]
    # Say what the simulation holds, then what each shot would cost.
    traffic = scenario.traffic
    types = {key: trace.type_id for key, trace in zip(motion.ids, traffic.traces, strict=True)}
    sun = sun_report(job, location=scenario.network.location)
    report: dict[str, Any] = {
        "network": {
            "file": str(files.network),
            "lanes": len(scenario.network.lanes),
            "signals": len({c.tls for c in scenario.network.connections if c.tls}),
        },
        "log": {
            "begin": traffic.begin,
            "end": traffic.end,
            "step": traffic.step,
            "road_users": dict(Counter(trace.kind for trace in traffic.traces)),
        },
        "sun": None if sun is None else sun.as_dict(),
        "weather": weather_report(job).as_dict(),
        "motion": lawfulness(motion).as_dict(),
        "missing_files": [str(path) for path in files.missing],
        "origin": {},
        "nobody": idle(job.vehicles.by_id, types),
        "unseen": [],
        "shots": [],
    }
    frames = [frame_times(w.start, w.end, job.output.fps, w.speed) for w in windows]
    outings = [Outing(w.camera, _sparse(w, t)) for w, t in zip(windows, frames, strict=True)]
    shared = outlooks(job, files, scenario, motion, outings)
    drawn: dict[str, str] = {}
    for window, times, outing, outlook in zip(windows, frames, outings, shared, strict=True):
        request, survey = Request(camera=window.camera), Survey(outlook or Outlook(), motion)
        production = prepare(job, request, outing.times, survey=survey)
        names = presets or catalog.template_names("quality")
        qualities = {
            name: _traced(quality_preset(name, together=len(times) > 1), job.cameras[window.camera])
            for name in names
        }
        report["origin"] = dict(production.shot.data.origin)
        shot = _shot(production, qualities, len(times)) | {"about": outlook is not None}
        about = {"camera": window.camera, "from": window.start, "to": window.end}
        report["shots"].append({**about, **shot})
        drawn |= {each.id: each.type_id for each in production.shot.fleet.trajectories}
    unseen = idle(job.vehicles.by_id, drawn)
    report["unseen"] = [each for each in unseen if each not in report["nobody"]]
    return report


def _sparse(span: _Span, times: Floats) -> Floats:
    """Return times that stand for all of a shot's: its plan does not need every frame, (n,) [s]."""
    return times[:: max(1, len(times) // 50)] if len(times) else np.array([span.start])


def _traced(quality: Quality, camera: CameraSettings) -> Quality:
    """Return a quality with all samples that a camera takes: reflections take a further pass."""
    if not camera.mirrored:
        return quality
    return quality.model_copy(update={"spp": quality.spp + reflection_samples(quality.spp)})


def _shot(production: Production, qualities: Mapping[str, Quality], frames: int) -> dict[str, Any]:
    """Return what one shot holds and costs."""
    output = production.job.output
    data, stands = production.shot.data, production.shot.stands
    families = Counter[str]()
    for part in data.static:
        families[part.family] += len(part.part.mesh.faces)
    users = data.slots.near.keys() - stands.prototypes.keys()
    bodies = sum(data.prototypes[name].triangles for name in users)
    far = sum(
        count * sum(len(part.mesh.faces) for part in data.prototypes[name].far)
        for name, count in data.slots.far.items()
    )
    far += sum(
        count * data.prototypes[name].triangles for name, count in data.slots.deforming.items()
    )
    families[SHARED] += stands.triangles
    total = sum(families.values()) + bodies + far
    moved = total - stands.triangles
    factor = conditions_factor(output.size, dark=production.shot.dark, weather=data.weather)
    return {
        "frames": frames,
        "fps": in_short(output.fps),
        "size": list(output.size),
        "sound": _sound(output.sound),
        "triangles": {**families, "road users": bodies + far, "total": total},
        "over_budget": moved > TRIANGLE_BUDGET,
        "parts": _parts(data),
        "left_out": [_left_out(item) for item in data.left_out],
        "not_compiled": _not_compiled(production, moved),
        "forecast": {
            name: film_cost(
                quality, output, triangles=total, frames=frames, factor=factor
            ).as_dict()
            for name, quality in qualities.items()
        },
    }


def _sound(wanted: SoundSettings | None) -> str:
    """Return what sound a film has, in words; empty where it has none."""
    if wanted is None or wanted.play == "none":
        return ""
    murmur = "none" if wanted.murmur is None else f"{wanted.murmur:g} dB(A)"
    return (
        f"{wanted.play}, of everybody within {wanted.radius:g} m, murmur {murmur};"
        f" a full-scale sine is {wanted.full_scale:g} dB"
    )


def _left_out(item: LeftOut) -> dict[str, Any]:
    """Return what was left out, why, and what that saves; None where nobody knows."""
    spared = item.triangles
    return {
        "what": item.what,
        "why": item.why,
        "triangles": spared,
        "cpu_seconds_per_frame": None if spared is None else round(PROCESSOR.update_of(spared), 4),
    }


def _not_compiled(production: Production, triangles: int) -> list[dict[str, Any]]:
    """Return what a shot's kernel does without, and what that saves; None where nobody knows.

    Args:
        production: The shot.
        triangles: Of it.
    """
    from sumo3dviz_pt.render.kernel.rows import OPERATIONS, features_of
    from sumo3dviz_pt.shot.road_users import shutter_of

    there = features_of(production.shot.data)
    absent: list[dict[str, Any]] = [
        {"what": name, "operations": count, "cpu_seconds_per_frame": None}
        for name, count in OPERATIONS.items()
        if name not in there
    ]
    shutter = shutter_of(production.settings, 1.0 / float(production.job.output.fps))
    if shutter.is_instant:
        # Each further moment of an exposure moves everything again.
        each = round(PROCESSOR.update_of(triangles), 4)
        absent.append({"what": MOMENTS, "operations": None, "cpu_seconds_per_frame": each})
    return absent


def _parts(data: SceneData) -> dict[str, int]:
    """Return the objects that the renderer holds."""
    return {
        "static meshes": len(data.static),
        "materials": len(data.materials),
        "near slots": sum(data.slots.near.values()),
        "far slots": sum(data.slots.far.values()),
        "deforming slots": sum(data.slots.deforming.values()),
        "lamps": sum(len(lamps.lamps) for lamps in data.lamps),
    }


def in_words(report: dict[str, Any], *, details: bool = True) -> str:
    """Return the report as people read it.

    Args:
        report: What `check_scene` found.
        details: Whether it says why things are left out, and what is built and compiled, too.
    """
    log, network = report["log"], report["network"]
    users = ", ".join(_many(count, kind) for kind, count in sorted(log["road_users"].items()))
    lines = [
        f"network  {network['file']}: {_many(network['lanes'], 'lane')},"
        f" {_many(network['signals'], 'traffic light')}",
        f"log      {log['begin']:.12g} to {log['end']:.12g} s every {log['step']:g} s:"
        f" {users or 'empty'}",
    ]
    lines += [f"sun      {report['sun']['text']}"] if report["sun"] else []
    origin = "; ".join(f"{how}: {what}" for how, what in report.get("origin", {}).items())
    lines += [f"town     {origin}"] if origin else []
    weather = report["weather"]
    lines += [f"weather  {weather['text']}"]
    if weather["moments"] and weather["left_out"]:
        lines += [f"         left out: {', '.join(weather['left_out'])}"]
    lines += [f"missing  {path}" for path in report["missing_files"]]
    lines += [f"note     {report['motion']['text']}"] if report["motion"]["text"] else []
    lines += [f"note     vehicles.by_id: {each!r} fits nobody" for each in report["nobody"]]
    lines += [
        f"note     vehicles.by_id: {each!r} is in no shot's view" for each in report["unseen"]
    ]
    shots = report["shots"]
    common = _common([shot["left_out"] for shot in shots])
    lines += _left_out_lines("left out of all shots", common, details=details)
    for shot in shots:
        lines += _shot_lines(shot, known=common, details=details)
    return "\n".join(lines)


def _many(count: int, word: str) -> str:
    """Return a number of things in words."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def _left_out_lines(head: str, items: Sequence[Any], *, details: bool) -> list[str]:
    """Return what is left out: a line for each thing with its reason, or their names in one."""
    if details:
        return [f"{head}  {_saving(item)}" for item in items]
    names = ", ".join(item["what"] for item in items)
    return [f"{head}  {names} (-v says why)"] if items else []


def _common(lists: Sequence[list[Any]]) -> list[Any]:
    """Return what several lists have in common; nothing of a single one."""
    if len(lists) < 2:
        return []
    return [item for item in lists[0] if all(item in other for other in lists[1:])]


def _shot_lines(
    shot: dict[str, Any], *, known: Sequence[Any] = (), details: bool = True
) -> list[str]:
    """Return one shot as people read it, without what was told of all shots."""
    triangles = dict(shot["triangles"])
    total = f"{'about ' if shot.get('about') else ''}{triangles.pop('total'):,}"
    kinds = ", ".join(f"{k} {v:,}" for k, v in triangles.items() if v)
    parts = ", ".join(f"{count} {name}" for name, count in shot["parts"].items() if count)
    lines = [
        "",
        f"shot     {shot['camera']}, {shot['from']:.12g} to {shot['to']:.12g} s,"
        f" {counted(shot['frames'], 'frame')} of {shot['size'][0]}x{shot['size'][1]},"
        f" {shot['fps']} a second",
        f"  triangles {total}" + (f": {kinds}" if details else ""),
    ]
    lines += [f"  sound     {shot['sound']}"] if shot.get("sound") else []
    if details:
        lines.append(f"  parts     {parts}")
    if shot["over_budget"]:
        lines.append(f"  note      more than {TRIANGLE_BUDGET:,} triangles make every frame slower")
    left_out = [item for item in shot["left_out"] if item not in known]
    lines += _left_out_lines("  left out", left_out, details=details)
    if details:
        lines += _compiled_lines(shot["not_compiled"])
    return lines + _cost_lines(shot)


def _saving(item: dict[str, Any]) -> str:
    """Return what was left out, why, and what that saves, if that is known."""
    line = f"{item['what']}: {item['why']}"
    if not item["triangles"]:
        return line
    seconds = item["cpu_seconds_per_frame"]
    felt = f" and {seconds:.2f} CPU-s a frame" if seconds >= _LEAST_TOLD else ""
    return f"{line}; saves about {item['triangles']:,} triangles{felt}"


def _compiled_lines(absent: Sequence[dict[str, Any]]) -> list[str]:
    """Return what the kernel does without, and what each of it would cost."""
    if not absent:
        return []
    words = [
        f"{item['what']} ({item['operations']:,} operations)"
        if item["operations"] is not None
        else f"{item['what']} (each {item['cpu_seconds_per_frame']:.2f} CPU-s a frame)"
        for item in absent
    ]
    return [f"  not compiled  {', '.join(words)}"]


_COST_HEAD = ("", "CPU-s a frame", "CPU time", "time here", "memory", "frames", "film")


def _cost_lines(shot: dict[str, Any]) -> list[str]:
    """Return what each preset costs, as a table; the cheapest first."""
    rows = [
        (
            name,
            f"{cost['cpu_seconds_per_frame']:g}",
            time_in_words(3600 * cost["cpu_hours"]),
            time_in_words(cost["wall_seconds"]),
            space_in_words(cost["memory_mb"]),
            space_in_words(cost["frames_mb"]),
            space_in_words(cost["film_mb"]),
        )
        for name, cost in sorted(shot["forecast"].items(), key=lambda item: item[1]["cpu_hours"])
    ]
    return [
        f"  {name:<9} " + "".join(f"{cell:>15}" for cell in rest)
        for name, *rest in (_COST_HEAD, *rows)
    ]
