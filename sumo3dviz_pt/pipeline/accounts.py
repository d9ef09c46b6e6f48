"""Says what a picture was made from: its key, and the account that is stored with it.

Two frames with the same key and time are the same picture. The key holds everything that pixels
depend on; files count by content, because a name says nothing.

The account says of road users their bodies, colours, motion and lamps. Two films show the same
traffic if these are the same; motion is told by digests, because the places of a hundred road users
in a thousand frames would be most of the account.

Digests of what was built, the world and a shot's plan of it, tell whether two pictures show the
same things, whatever made them. Lengths count to a tenth of a millimetre, other numbers to six
digits: processors differ in the last bits.

The weather is told in figures, and what of it a scene leaves out.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.surroundings import WeatherSettings
from sumo3dviz_pt.model.camera import Shutter
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import FrameState, Mover, SceneData, Sky
from sumo3dviz_pt.model.weather import CONTRAST, Weather, WeatherCourse
from sumo3dviz_pt.pipeline.metering import metering_of
from sumo3dviz_pt.pipeline.provenance import (
    FILM_RECORD,
    by_role,
    package_hashes,
    versions,
    with_files,
)
from sumo3dviz_pt.pipeline.traffic import ridden_ids

if TYPE_CHECKING:
    from sumo3dviz_pt.model.network import Location
    from sumo3dviz_pt.model.scene import View
    from sumo3dviz_pt.pipeline.production import Production
    from sumo3dviz_pt.shot.build import Shot


_CLEAR = "dry and clear summer"


def preset_weather(name: str) -> WeatherSettings:
    """Return a preset of weather.

    Raises:
        ConfigError: If there is no such preset.
    """
    return WeatherSettings.model_validate({"preset": name, **catalog.template("weather", name)})


@dataclass(frozen=True, slots=True)
class WeatherReport:
    """The weather of a scene.

    Attributes:
        course: Over time; None for none.
    """

    course: WeatherCourse | None

    @property
    def left_out(self) -> tuple[str, ...]:
        """Kinds of weather that nothing is built, compiled or sampled for."""
        course = self.course
        kinds = {
            "fog": course is not None and any(each.fog is not None for each in course.moments),
            "rain": course is not None and course.rains,
            "wet roads": course is not None and course.is_wet,
            "snow on the ground": course is not None and course.is_snowy,
            "falling snow": course is not None and course.snows,
            "wind": course is not None and course.first.wind is not None,
        }
        return tuple(kind for kind, there in kinds.items() if not there)

    def __str__(self) -> str:
        if self.course is None:
            return _CLEAR
        text = [in_words(moment) for moment in self.course.moments]
        if not self.course.changes:
            return text[0]
        times = self.course.times
        return "; ".join(f"{time:.12g} s: {words}" for time, words in zip(times, text, strict=True))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        course = self.course
        moments = [] if course is None else list(zip(course.times, course.moments, strict=True))
        return {
            "text": str(self),
            "moments": [{"time": time, **weather_account(each)} for time, each in moments],
            "left_out": list(self.left_out),
        }


def weather_report(job: Job) -> WeatherReport:
    """Return what weather a scene has."""
    from sumo3dviz_pt.world.weather import weather_course

    return WeatherReport(weather_course(job.weather))


def in_words(weather: Weather) -> str:
    """Return a weather in one line."""
    words = {name: list(kind.in_words()) for name, kind in weather.kinds.items()}
    air = [word for name in ("fog", "rain") for word in words.pop(name, ())]
    if weather.falls > 0.0:
        air.append(f"seen through what falls {CONTRAST / weather.falls / 1000:.1f} km")
    if weather.wetness > 0.0 or weather.puddles > 0.0:
        air.append(f"wetness {weather.wetness:.2g}, puddles {weather.puddles:.2g}")
    return ", ".join([*air, *(word for some in words.values() for word in some), weather.season])


def weather_account(weather: Weather) -> dict[str, Any]:
    """Return a weather for JSON, with units in its keys; only what there is."""
    content: dict[str, Any] = {
        "extinction_per_km": round(1000.0 * weather.extinction, 4),
        "wetness": round(weather.wetness, 4),
        "puddles": round(weather.puddles, 4),
        "season": weather.season,
    }
    kinds = {name: kind.account() for name, kind in weather.kinds.items()}
    return content | {name: account for name, account in kinds.items() if account}


_STEP = 1.0e-4
"""Placements count to a tenth of a millimetre: processors differ in the last bits [m]."""


@dataclass(slots=True)
class _KnownUser:
    """What is known of one road user so far."""

    body: str
    colour: tuple[float, ...]
    first: int
    last: int = 0
    lit: list[tuple[int, list[str]]] = field(default_factory=list)
    motion: Any = field(default_factory=lambda: hashlib.blake2b(digest_size=8))


@dataclass(slots=True)
class RoadUsers:
    """Collects what frames show of road users, in their order."""

    _known: dict[str, _KnownUser] = field(default_factory=dict)

    def add(self, number: int, frame: FrameState) -> str:
        """Take a frame; return a digest of where everyone is, and in which pose.

        Args:
            number: The frame's.
            frame: What it shows.
        """
        whole = hashlib.blake2b(digest_size=8)
        for mover in sorted(frame.everyone, key=lambda each: (each.id, each.part)):
            where = _placement(mover)
            whole.update(where)
            # The part without a name, if there is one, comes first: it is the body.
            user = self._seen(number, mover)
            user.motion.update(f"{number}:".encode() + where)
        return whole.hexdigest()

    def account(self) -> dict[str, Any]:
        """Return what is known of each, by id; `lamps` has the frames at which lamps change."""
        return {
            key: {
                "body": user.body,
                "colour": list(user.colour),
                "frames": [user.first, user.last],
                "motion": user.motion.hexdigest(),
                "lamps": [{"frame": number, "lit": lit} for number, lit in user.lit],
            }
            for key, user in sorted(self._known.items())
        }

    def _seen(self, number: int, mover: Mover) -> _KnownUser:
        """Note that a road user is there, and which of its lamps shine."""
        colour = tuple(round(float(value), 6) for value in mover.colour)
        made = _KnownUser(_body(mover.prototype), colour, number)
        user = self._known.setdefault(mover.id, made)
        user.last, lit = number, sorted(mover.lit)
        if not user.lit or user.lit[-1][1] != lit:
            user.lit.append((number, lit))
        return user


def brake_onsets(lamps: Iterable[Any]) -> list[int]:
    """Return the frames at which brake lamps begin to shine, by a road user's `lamps`.

    Those that shine in the first frame have begun before.
    """
    frames, shone = [], True
    for change in lamps:
        shines = "brake" in change["lit"]
        if shines and not shone:
            frames.append(int(change["frame"]))
        shone = shines
    return frames


def _body(prototype: str) -> str:
    """Return the model that a body is of, at whatever level of detail it is drawn."""
    return prototype.partition("/")[0]


def _placement(mover: Mover) -> bytes:
    """Return which body stands where in which pose, for a digest."""
    steps = np.floor(mover.world_from_body.matrix[:3] / _STEP + 0.5)
    pose = f"{mover.name}|{mover.phase:.4f}|{mover.effort:.4f}|"
    return pose.encode() + steps.astype(np.int64).tobytes()


_GRID = 1.0e4
"""Steps of stored numbers in a unit, such as a metre."""

_OFF = 0.381966
"""Offset from the grid, in steps: round numbers lie inside a step, where last bits do nothing."""

_Feed = Callable[[bytes | memoryview], None]

_Known = dict[tuple[Any, ...], tuple[bytes, np.ndarray[Any, Any]]]
"""Digests of arrays by where their numbers lie; the arrays are kept, so nothing else lies there."""


def world_digest(data: SceneData) -> str:
    """Return a digest of what stands: ground, roads, houses, plants, lamps, and their materials.

    How plants move counts where any do.
    """
    swaying = (data.swaying,) if data.swaying else ()
    return _digest(data.static, data.materials, data.lamps, *swaying)


def light_digest(data: SceneData) -> str:
    """Return a digest of what lights it and of the air: sun or moon, sky, haze, weather."""
    return _digest(data.sky, data.haze, *(() if data.weather is None else (data.weather,)))


def plan_digest(data: SceneData, full_models: frozenset[str]) -> str:
    """Return a digest of the road users that can be shown: bodies, levels of detail, room.

    Args:
        data: Of a shot.
        full_models: Models that it draws in full detail.
    """
    return _digest(data.prototypes, data.slots, data.running, sorted(full_models))


def _digest(*values: Any) -> str:
    """Return one digest of many values."""
    whole = hashlib.blake2b(digest_size=16)
    known: _Known = {}
    for value in values:
        _take(value, whole.update, known)
    return whole.hexdigest()


def _take(value: Any, feed: _Feed, known: _Known) -> None:
    """Feed a value, whatever is in it."""
    if isinstance(value, np.ndarray):
        feed(_array_digest(value, known))
    elif isinstance(value, Mapping):
        for key in sorted(value):
            feed(f"{key}:".encode())
            _take(value[key], feed, known)
    elif isinstance(value, list | tuple | frozenset):
        feed(f"[{len(value)}".encode())
        for item in sorted(value) if isinstance(value, frozenset) else value:
            _take(item, feed, known)
    elif is_dataclass(value):
        for name, item in _attributes(value):
            feed(f"{name}=".encode())
            _take(item, feed, known)
    else:
        feed(_word(value).encode())


def _attributes(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield a value's attributes; of a sky's pictures, hashed as files, whether they exist."""
    for attribute in fields(value):
        item = getattr(value, attribute.name)
        is_picture = isinstance(value, Sky) and attribute.name in ("image", "clouds", "overcast")
        yield attribute.name, (item is not None) if is_picture else item


def _array_digest(array: np.ndarray[Any, Any], known: _Known) -> bytes:
    """Return the digest of an array, made once for all that look at the same numbers.

    Bodies of many colours share most of theirs.
    """
    where = (array.__array_interface__["data"][0], array.shape, array.strides, array.dtype.str)
    if where not in known:
        whole = hashlib.blake2b(f"{array.shape}".encode(), digest_size=16)
        whole.update(_steps(array).data)
        known[where] = (whole.digest(), array)
    return known[where][0]


def _steps(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return an array's whole numbers as they are, others as steps of a grid."""
    if array.dtype.kind != "f":
        return np.ascontiguousarray(array, dtype=np.int64)
    steps = array * np.float64(_GRID)
    steps += _OFF
    return np.ascontiguousarray(np.floor(steps, out=steps))


def _word(value: Any) -> str:
    """Return a number, a name or nothing, as text; of a file, only what it is called."""
    if isinstance(value, float):
        return f"{value:.6g};"
    text = str(value)
    return f"{Path(text).name if '/' in text or chr(92) in text else text};"


_APART = frozenset({"scenario", "template", "cameras", "shots", "output", "overlays", "quality"})
"""Keys of a scene file that are not hashed as they stand: they count by content, or in part."""


def key_of(production: Production) -> str:
    """Return a hash of all that a frame's pixels depend on, beside its time and what traces it.

    What traces, a variant or a GPU, changes pixels by rounding and noise only. It stands beside the
    key in each frame's account, so that frames of one film are known as such on every machine.
    The shot's window counts: wheels turn and people step by the way since its beginning, and the
    room for road users depends on all of its frames. What acts on the developed picture alone
    (tone curve, glare, response, codec) does not count, nor do layers, which lie beside the
    pictures, nor names of files and presets.
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
        "versions": versions(),
        "package": package_hashes(),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def _cameras(job: Job, name: str) -> list[Any]:
    """Return the camera, and others that keep the world clear."""
    from sumo3dviz_pt.shot.cameras.aiming import clearing

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
        **FILM_RECORD.stamp,
        "key": production.key,
        "command": production.command,
        "camera": production.camera,
        "exposure": production.exposure,
        **metering_of(production),
        **_shutter(production.shot.camera.shutter),
        **({} if production.optics is None else {"optics": asdict(production.optics)}),
        "tone": job.output.tone,
        "glare": job.output.glare,
        "response": job.output.response,
        "seed": job.seed,
        "spp": production.quality.spp,
        "quality": job.quality,
        "preset": production.quality.model_dump(exclude={"purpose"}),
        **({} if production.pilot is None else {"pilot": dict(production.pilot)}),
        "variant": production.variant,
        **production.device,
        "scene": with_files(job.model_dump(by_alias=True), inputs.name),
        "inputs": dict(sorted(inputs.hashes.items())),
        **({"companions": inputs.companions} if inputs.companions else {}),
        **({"origin": dict(data.origin)} if data.origin else {}),
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
    values = {"open": shutter.open_for, "rolling": shutter.rolling}
    return {"shutter": {name: round(value, 9) for name, value in values.items()}}


def _lens(lens: Lens) -> dict[str, Any]:
    """Return what a lens has that a pinhole has not, rounded."""
    rest = {name: value for name, value in lens.as_dict().items() if name != "opening"}
    return {
        name: round(value, 6) if isinstance(value, float) else value for name, value in rest.items()
    }
