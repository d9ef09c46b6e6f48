"""Validates a whole scene and says what it holds, what it leaves out and what it costs."""

from __future__ import annotations

from collections import Counter
from typing import Any

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job import Job
from sumo3dviz_pt.jobfile import quality_preset
from sumo3dviz_pt.model.scene import SceneData
from sumo3dviz_pt.pipeline import Production, Request, frame_times, life_of, prepare, read

TRIANGLE_BUDGET = 1_500_000
"""Unique triangles per shot that keep the update of a frame below half a CPU-second."""

_COST = {
    "per_megasample": 1.0,
    "per_megapixel": 4.0,
    "per_megatriangle": 0.6,
    "fixed": 0.1,
}
"""CPU-seconds, from `tests/bench/presets.py` on the bundled `ronda`; see docs/internals.md."""


def check_scene(job: Job) -> dict[str, Any]:
    """Build every shot without rendering and report on it.

    Raises:
        ConfigError: If a setting is wrong.
        InputError: If a file is wrong.
    """
    import numpy as np

    from sumo3dviz_pt.pipeline import check_tone

    check_tone(job.output.tone)
    shots = [(shot.camera, shot.start, shot.end) for shot in job.shots]
    files, scenario, trajectories = read(job)
    if not shots:
        shots = [(name, *life_of(camera, trajectories)) for name, camera in job.cameras.items()]
    traffic = scenario.traffic
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
        "missing_files": [str(path) for path in files.missing],
        "shots": [],
    }
    for camera, start, end in shots:
        times = frame_times(start, end, job.output.fps)
        # A film's plan does not need every frame to say what it holds.
        sparse = times[:: max(1, len(times) // 50)] if len(times) else np.array([start])
        production = prepare(job, Request(camera=camera), sparse)
        report["shots"].append(_shot(production, camera, start, end, frames=len(times)))
    return report


def _shot(
    production: Production, camera: str, start: float, end: float, *, frames: int
) -> dict[str, Any]:
    """What one shot holds and costs."""
    data = production.shot.data
    families = Counter[str]()
    for part in data.static:
        families[part.family] += len(part.part.mesh.faces)
    bodies = sum(data.prototypes[name].triangles for name in data.slots.near)
    far = sum(
        count * sum(len(part.mesh.faces) for part in data.prototypes[name].far)
        for name, count in data.slots.far.items()
    )
    far += sum(count * data.prototypes[name].triangles for name, count in data.slots.posed.items())
    total = sum(families.values()) + bodies + far
    return {
        "camera": camera,
        "from": start,
        "to": end,
        "frames": frames,
        "triangles": {**families, "road users": bodies + far, "total": total},
        "over_budget": total > TRIANGLE_BUDGET,
        "parts": _parts(data),
        "left_out": [{"what": item.what, "why": item.why} for item in data.left_out],
        "forecast": {
            name: _forecast(production, name, triangles=total, frames=frames)
            for name in catalog.template_names("quality")
        },
    }


def _parts(data: SceneData) -> dict[str, int]:
    """Objects that the renderer holds."""
    return {
        "static meshes": len(data.static),
        "materials": len(data.materials),
        "near slots": sum(data.slots.near.values()),
        "far slots": sum(data.slots.far.values()),
        "posed slots": sum(data.slots.posed.values()),
        "lamps": sum(len(lamps.lamps) for lamps in data.lamps),
    }


def _forecast(
    production: Production, name: str, *, triangles: int, frames: int
) -> dict[str, float]:
    """CPU-seconds per frame and film, memory in MB."""
    quality = quality_preset(name)
    width, height = production.job.output.size
    pixels = width * height / 1e6
    seconds = _COST["fixed"] + _COST["per_megatriangle"] * triangles / 1e6
    seconds += _COST["per_megasample"] * pixels * quality.spp
    if quality.denoise != "none":
        seconds += _COST["per_megapixel"] * pixels
    return {
        "cpu_seconds_per_frame": round(seconds, 2),
        "cpu_hours": round(seconds * frames / 3600, 2),
        "memory_mb": round(memory_forecast(pixels, triangles)),
    }


def memory_forecast(megapixels: float, triangles: int) -> float:
    """Memory that a picture needs at its peak [MB]."""
    return 900 + 900 * megapixels + 300 * triangles / 1e6


def in_words(report: dict[str, Any]) -> str:
    """The report as people read it."""
    log, network = report["log"], report["network"]
    users = ", ".join(f"{count} {kind}s" for kind, count in sorted(log["road_users"].items()))
    lines = [
        f"network  {network['file']}: {network['lanes']} lanes,"
        f" {network['signals']} traffic lights",
        f"log      {log['begin']:g} to {log['end']:g} s every {log['step']:g} s:"
        f" {users or 'empty'}",
    ]
    lines += [f"missing  {path}" for path in report["missing_files"]]
    for shot in report["shots"]:
        lines += _shot_lines(shot)
    return "\n".join(lines)


def _shot_lines(shot: dict[str, Any]) -> list[str]:
    """One shot as people read it."""
    triangles = dict(shot["triangles"])
    total = triangles.pop("total")
    parts = ", ".join(f"{count} {name}" for name, count in shot["parts"].items() if count)
    lines = [
        "",
        f"shot     {shot['camera']}, {shot['from']:g} to {shot['to']:g} s, {shot['frames']} frames",
        f"  triangles {total:,}: " + ", ".join(f"{k} {v:,}" for k, v in triangles.items() if v),
        f"  parts     {parts}",
    ]
    if shot["over_budget"]:
        lines.append(f"  note      more than {TRIANGLE_BUDGET:,} triangles make every frame slower")
    lines += [f"  left out  {item['what']}: {item['why']}" for item in shot["left_out"]]
    for name, cost in sorted(shot["forecast"].items(), key=lambda item: item[1]["cpu_hours"]):
        lines.append(
            f"  {name:<9} about {cost['cpu_seconds_per_frame']:g} CPU-s a frame,"
            f" {cost['cpu_hours']:g} CPU-hours, {cost['memory_mb']} MB"
        )
    return lines
