"""Says what a picture was made from: its key, and the account that is stored with it.

Two frames with the same key and time are the same picture. The key holds everything that pixels
depend on; files count by content, because a name says nothing.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.shutter import Shutter
from sumo3dviz_pt.pipeline.accounts.digests import light_digest, plan_digest, world_digest
from sumo3dviz_pt.pipeline.accounts.provenance import by_role, package_hashes, versions, with_files
from sumo3dviz_pt.pipeline.accounts.road_users import RoadUsers
from sumo3dviz_pt.pipeline.gaps import ridden_ids
from sumo3dviz_pt.pipeline.metering import metering_of
from sumo3dviz_pt.pipeline.weather_report import weather_account

if TYPE_CHECKING:
    from sumo3dviz_pt.model.network import Location
    from sumo3dviz_pt.model.scene import FrameState, View
    from sumo3dviz_pt.pipeline.production import Production
    from sumo3dviz_pt.shot.build import Shot

_APART = frozenset({"scenario", "template", "cameras", "shots", "output", "overlays", "quality"})
"""Keys of a scene file that are not hashed as they stand: they count by content, or in part."""


def key_of(production: Production) -> str:
    """Return a hash of everything that a frame's pixels depend on, beside its time.

    The shot's window counts: wheels turn and people step by the way since its beginning, and the
    room for road users depends on all of its frames. What acts on the developed picture alone
    (tone curve, glare, codec) does not count, nor do layers, which lie beside the pictures, nor
    names of files and presets.
    """
    job, inputs, times = production.job, production.inputs, production.times
    settings = {name: value for name, value in job.model_dump().items() if name not in _APART}
    files = by_role(production.files)
    content = {
        "settings": with_files(settings, inputs.content),
        "cameras": with_files(_cameras(job, production.camera), inputs.content),
        **({} if job.traffic is None else {"ridden": sorted(ridden_ids(job))}),
        "files": {role: [inputs.content(path) for path in some] for role, some in files.items()},
        "truncated": job.scenario.allow_truncated,
        "window": [float(times[0]), float(times[-1]), len(times)],
        "plan": _plan(production.shot),
        "size": list(job.output.size),
        "half": job.output.half,
        "exposure": job.output.exposure,
        **({} if production.metered is None else {"metered": production.metered}),
        "quality": production.quality.model_dump(exclude={"purpose"}),
        "variant": production.variant,
        "versions": versions(),
        "package": package_hashes(),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def _cameras(job: Job, name: str) -> list[Any]:
    """Return the camera, and others that keep the world clear."""
    from sumo3dviz_pt.shot.cameras.clearances import clearing

    others = (camera for other, camera in job.cameras.items() if other != name)
    return [camera.model_dump() for camera in (job.cameras[name], *clearing(others))]


def _plan(shot: Shot) -> dict[str, Any]:
    """Return what was built for a shot, counted: whole numbers are the same on every processor."""
    data, slots = shot.data, shot.data.slots
    return {
        "static": [[part.id, *_counts(part.part.mesh)] for part in data.static],
        "lamps": [[lamps.id, len(lamps.lamps)] for lamps in data.lamps],
        "bodies": {
            name: [_counts(part.mesh) for part in (*body.parts, *body.far)]
            for name, body in data.prototypes.items()
        },
        "slots": [dict(level) for level in (slots.near, slots.far, slots.deforming)],
        "limit": shot.limit,
        "full_models": sorted(shot.full_models),
    }


def _counts(mesh: Any) -> tuple[int, int]:
    """Return the vertices and triangles of a mesh."""
    return len(mesh.vertices), len(mesh.faces)


def account_of(production: Production) -> dict[str, Any]:
    """Return what all pictures of a production were made from, as plain values.

    There is no clock in it, so that the same command gives the same bytes; and no path of this
    machine: a file stands by the name under which `inputs` has its hash.
    """
    job, inputs, data = production.job, production.inputs, production.shot.data
    return {
        "key": production.key,
        "command": production.command,
        "camera": production.camera,
        "exposure": production.exposure,
        **metering_of(production),
        **_shutter(production.shot.camera.shutter),
        **({} if production.optics is None else {"optics": asdict(production.optics)}),
        "tone": job.output.tone,
        "glare": job.output.glare,
        "seed": job.seed,
        "spp": production.quality.spp,
        "quality": job.quality,
        "preset": production.quality.model_dump(exclude={"purpose"}),
        **({} if production.pilot is None else {"pilot": dict(production.pilot)}),
        "variant": production.variant,
        "scene": with_files(job.model_dump(by_alias=True), inputs.name),
        "inputs": dict(sorted(inputs.hashes.items())),
        **({"companions": inputs.companions} if inputs.companions else {}),
        "world": world_digest(data),
        "light": light_digest(data),
        "plan": plan_digest(data, production.shot.full_models),
        "versions": versions(),
        "package": package_hashes(),
    }


def film_account(
    production: Production, name: str, *, shared: Mapping[str, Any], pace: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the JSON beside a film: what all of it is made from, and what every frame shows.

    Args:
        production: The film's.
        name: The film's.
        shared: What its frames say of it.
        pace: Frame rate and speed.
    """
    frames, users = [], RoadUsers()
    location = production.shot.fleet.location
    states: dict[str, str] = {}
    changes = []
    for number, at in enumerate(production.times.tolist()):
        frame = production.shot.frame_at(at)
        frames.append(
            {**_frame_account(number, frame, location), "placed": users.add(number, frame)}
        )
        now = production.shot.states_at(at)
        changes += [
            {"frame": number, "time": at, "tls": tls, "state": state}
            for tls, state in sorted(now.items())
            if states.get(tls) != state
        ]
        states = now
    return {
        "film": name,
        **pace,
        "size": list(production.job.output.size),
        **shared,
        "left_out": [
            {"what": item.what, "why": item.why} for item in production.shot.data.left_out
        ],
        "signal_changes": changes,
        "road_users": users.account(),
        "frames": frames,
    }


def _frame_account(number: int, frame: FrameState, location: Location) -> dict[str, Any]:
    """Return what one frame shows, in SUMO's coordinates."""
    return {
        "frame": number,
        "time": frame.time,
        "camera": camera_account(frame.view, location),
        "drawn": sorted(frame.users),
        **({} if frame.weather is None else {"weather": weather_account(frame.weather)}),
    }


def camera_account(view: View, location: Location) -> dict[str, Any]:
    """Return where a camera is, how it looks and with which lens, in SUMO's coordinates."""
    matrix = view.world_from_camera.matrix
    return {
        "position": [round(float(value), 6) for value in location.outside(view.position)],
        "forward": [round(float(value), 9) for value in matrix[:3, 0]],
        "up": [round(float(value), 9) for value in matrix[:3, 2]],
        "fov": round(float(np.degrees(view.lens.opening)), 6),
        **({} if view.lens.is_pinhole else {"lens": _lens(view.lens)}),
    }


def _shutter(shutter: Shutter) -> dict[str, Any]:
    """Return what an account says of a shutter; nothing of an instant."""
    if shutter.is_instant:
        return {}
    said = {"open": shutter.open_for, "rolling": shutter.rolling}
    return {"shutter": {name: round(value, 9) for name, value in said.items()}}


def _lens(lens: Lens) -> dict[str, Any]:
    """Return what a lens has that a pinhole has not, rounded."""
    said = {name: value for name, value in lens.as_dict().items() if name != "opening"}
    return {
        name: round(value, 6) if isinstance(value, float) else value for name, value in said.items()
    }
