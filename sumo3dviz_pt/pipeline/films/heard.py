"""Makes the sound of a film: of road users near its camera, behind walls or not, rain and murmur.

Sound is what the camera's place would hear, or a person in the vehicle where the camera looks out
of one. It is made anew whenever a film is, from the same motion as its pictures; it hangs on the
scene, the shot and the time alone.

Levels of rain and of a town's murmur are our own, and so is the murmur's spectrum: rain of 1 mm/h
has 40 dB(A), and 14 dB more for ten times as much.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import atomic_path
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.surroundings import SoundSettings
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.numbers import in_short
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.films.frames import is_sequence
from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.films.screens import Screens
from sumo3dviz_pt.pipeline.films.sound import (
    Nearby,
    accelerations_of,
    nearby,
    recording_file,
)

if TYPE_CHECKING:
    from sumo3dviz_pt.model.scene import View
    from sumo3dviz_pt.pipeline.production import Production
    from sumo3dviz_pt.sound.render import Bed, SoundScene, Source

log = logging.getLogger(__name__)

_FADE = 0.1  # over which who appears gets loud [s]
_EVEN = 0.25  # over which speeds are evened out on either side [s]
_SPARE = 5  # steps of motion before and behind all that is heard
_FAINTEST = 5.0  # level below which nobody hears a source [dB(A)]
_LONGEST = 20.0  # of a body that is one source [m]

_RAIN = np.array([-20.0, -18.0, -14.0, -8.0, -3.0, 0.0, 0.0, -3.0])
_MURMUR = np.array([8.0, 4.0, 0.0, -2.0, -3.0, -8.0, -16.0, -28.0])
"""Spectra of what is all around, our own, in octave bands of 63 Hz to 8 kHz [dB]."""

_RAIN_LEVEL, _RAIN_SLOPE = 40.0, 14.0  # at 1 mm/h [dB(A)], and by the logarithm of the rate [dB]


def check_play(job: Job, pace: Pace) -> None:
    """Refuse sound of films that run faster or slower than time does.

    Args:
        job: The scene file.
        pace: How the film's time runs.

    Raises:
        ConfigError: If sound is wanted of one.
    """
    if is_heard(job) and pace.speed != 1:
        raise ConfigError(
            f"a film at {in_short(pace.speed)} times the speed has no sound: take speed 1, or"
            " output.sound.play: none",
            key="output.sound.play",
        )


def is_heard(job: Job) -> bool:
    """Return whether a film is to have sound."""
    return job.output.sound is not None and job.output.sound.play != "none"


def has_soundtrack(job: Job, path: Path) -> bool:
    """Return whether a film itself has sound: GIFs and numbered pictures have none."""
    from sumo3dviz_pt.video.soundtrack import SILENT

    return is_heard(job) and not is_sequence(path) and path.suffix.lower() not in SILENT


def write_recording(path: Path, production: Production, pace: Pace) -> dict[str, Any]:
    """Write the sound of a film beside it; nothing where none is wanted.

    Args:
        path: The film.
        production: What it shows.
        pace: How its time runs.

    Returns:
        What the film's account says of it; nothing where there is none.

    Raises:
        ConfigError: If it is too long for a WAV file.
    """
    wanted = production.job.output.sound
    if wanted is None or wanted.play == "none":
        return {}
    from sumo3dviz_pt.sound.ears import EARS
    from sumo3dviz_pt.sound.recording import record
    from sumo3dviz_pt.sound.render import Renderer
    from sumo3dviz_pt.sound.signals import RATE

    file, length = recording_file(path), len(production.times) / float(pace.fps)
    scene = sound_scene(production, wanted, length=length)
    count = round(length * RATE)
    try:
        with atomic_path(file) as part:
            loudness = record(Renderer(scene, EARS[wanted.play]), part, count)
    except ValueError as error:
        raise ConfigError(f"{file.name}: {error}; make the film shorter", key="to") from error
    _note(path, production.job, loudness.peak)
    return {"sound": _account(file, wanted, scene, count) | {"levels": loudness.as_dict()}}


def _note(path: Path, job: Job, peak: float) -> None:
    """Say what a listener would wonder about.

    Args:
        path: The film.
        job: Its settings.
        peak: Its largest sample, over full scale [dB].
    """
    wanted, file = job.output.sound, recording_file(path)
    assert wanted is not None, "it has sound"
    if not has_soundtrack(job, path):
        text = "%s plays no sound, as GIFs and numbered pictures cannot: it is in %s"
        log.warning(text, path, file)
    if peak == -np.inf:
        log.warning(
            "%s is silent: nobody who sounds is within %g m of the camera (output.sound.radius),"
            " and there is neither murmur nor rain",
            *(file, wanted.radius),
        )
    if peak > 0.0:
        log.warning(
            "%s: its loudest sample is %.1f dB above full scale, which players cut off; set"
            " output.sound.full_scale to %g or more",
            *(file, peak, np.ceil(wanted.full_scale + peak)),
        )


def _account(file: Path, wanted: SoundSettings, scene: SoundScene, count: int) -> dict[str, Any]:
    """Return what a film's account says of its sound, but for how loud it is."""
    from sumo3dviz_pt.sound.ears import EARS
    from sumo3dviz_pt.sound.signals import RATE

    return {
        "file": file.name,
        "play": wanted.play,
        "channels": list(EARS[wanted.play].names),
        "rate": RATE,
        "samples": count,
        "full_scale_sine_db": wanted.full_scale,
        "calibration": f"a sine of amplitude 1 stands for {wanted.full_scale:g} dB re 20 uPa (RMS)",
        "inside_vehicle": scene.enclosed,
        "sources": sorted({each.name.rsplit("/", 2)[0] for each in scene.sources}),
        "murmur_dba": wanted.murmur,
        "emission": "CNOSSOS-EU, (EU) 2015/996 as amended by (EU) 2021/1226",
    }


def sound_scene(production: Production, wanted: SoundSettings, *, length: float) -> SoundScene:
    """Return all that is heard in a film.

    Args:
        production: What it shows.
        wanted: How it is heard.
        length: Of the film [s].
    """
    from sumo3dviz_pt.sound.propagation import SPEED_OF_SOUND
    from sumo3dviz_pt.sound.render import STEP, SoundScene

    before = int(np.ceil(wanted.radius / SPEED_OF_SOUND / STEP)) + _SPARE
    clock = STEP * np.arange(-before, int(np.ceil(length / STEP)) + _SPARE + 1)
    times = np.asarray(float(production.times[0]) + clock, dtype=np.float64)
    views = _views(production, times)
    eyes, frames = _listener(views, times, production.times)
    first = views[0]
    shown = np.array(
        [production.shot.camera.view_at(at).position for at in production.times.tolist()]
    )
    around = nearby(production, shown, radius=wanted.radius)
    ridden = first.rides_in if first.cutaway else None
    shown_last = before + int((production.times[-1] - production.times[0]) / STEP)
    cast = _Cast.of(production, around, times, (before, shown_last), ridden)
    sources = [each for each in cast.sources() if _is_audible(each, eyes, wanted.radius)]
    ground = float(np.median([each.places[:, 2] for each in sources])) if sources else 0.0
    screens = Screens.of(production, around.polygons, eyes, ground=ground, radius=wanted.radius)
    return SoundScene(
        float(clock[0]),
        eyes,
        frames,
        tuple(screens.before(source, eyes) for source in sources),
        tuple(_beds(production, wanted, times)),
        wanted.radius,
        wanted.soft_ground,
        any(each.own for each in sources),
        wanted.full_scale,
        production.job.seed,
    )


# The listener ------------------------------------------------------------------------------


def _views(production: Production, times: Floats) -> list[View]:
    """Return the camera's views; before and after its shot, that of its end."""
    low, high = production.times[0], production.times[-1]
    return [production.shot.camera.view_at(at) for at in np.clip(times, low, high).tolist()]


def _listener(views: Sequence[View], times: Floats, shown: Floats) -> tuple[Floats, Floats]:
    """Return where the listener is, (n, 3) [m], and how it is turned, (n, 3, 3).

    The last picture stands for a while, in which the listener goes straight on.
    """
    eyes = np.array([view.position for view in views])
    frames = np.array([view.world_from_camera.matrix[:3, :3] for view in views])
    inside = (times >= shown[0] - 1e-9) & (times <= shown[-1] + 1e-9)
    return _onward(eyes, inside), frames


def _onward(places: Floats, known: Bools) -> Floats:
    """Return places that go straight on, as fast as before, where they are not known, (n, 3)."""
    rows = np.flatnonzero(known)
    first, last = rows[0], rows[-1]
    onward, steps = places.copy(), np.arange(len(places))[:, None]
    if first == last:
        return np.tile(places[first], (len(places), 1))
    onward[:first] = places[first] + (steps[:first] - first) * (places[first + 1] - places[first])
    onward[last + 1 :] = places[last] + (steps[last + 1 :] - last) * (
        places[last] - places[last - 1]
    )
    return onward


# Who sounds --------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Cast:
    """Everyone near a camera.

    Attributes:
        around: Road users near the camera.
        drawn: Those that the film shows, by key: they drive on the road that is drawn, not at the
            log's height.
        times: SUMO's, of samples of motion, (n,) [s].
        shown: Numbers of the samples of the first and of the last picture. Road users of
            these times are taken to be there before and after, as far as is heard.
        ridden: Key of whom the listener sits in, or None.
    """

    around: Nearby
    drawn: Mapping[str, Trajectory]
    times: Floats
    shown: tuple[int, int]
    ridden: str | None

    @classmethod
    def of(
        cls,
        production: Production,
        around: Nearby,
        times: Floats,
        shown: tuple[int, int],
        ridden: str | None,
    ) -> _Cast:
        """Return the road users near a shot's camera; arguments as the attributes."""
        drawn = {each.key: each for each in production.shot.fleet.trajectories}
        return cls(around, drawn, times, shown, ridden)

    def sources(self) -> Iterator[Source]:
        """Yield all sources."""
        from sumo3dviz_pt.sound.emission import category_of

        for each, kind in zip(self.around.trajectories, self.around.types, strict=True):
            if each.kind == "vehicle" and category_of(kind) != "silent":
                yield from self._of(self.drawn.get(each.key, each), kind)

    def _of(self, trajectory: Trajectory, kind: VehicleType) -> Iterator[Source]:
        """Yield a road user's sources: one for each time that it is there, and part of its body."""
        from sumo3dviz_pt.sound.emission import category_of, emission_of
        from sumo3dviz_pt.sound.render import HEIGHT, Source

        motion = trajectory.sample(self.times)
        own = trajectory.key == self.ridden and category_of(kind) in _CLOSED
        parts = 1 if own else int(np.ceil(kind.length / _LONGEST))
        for run in _runs(motion.alive):
            alive = np.zeros(len(self.times), dtype=np.bool_)
            alive[run] = True
            yaws, pitches = motion.yaws[run], motion.pitches[run]
            ahead = np.column_stack([np.cos(yaws), np.sin(yaws), np.tan(pitches)])
            ahead *= np.cos(pitches)[:, None]
            changes = accelerations_of(trajectory, self.times[run])
            emission = emission_of(
                kind,
                _evened(_held(np.abs(np.nan_to_num(motion.speeds[run])), run, len(alive))),
                _evened(_held(np.nan_to_num(changes), run, len(alive))),
            )
            each, there = emission.split(parts), _presence(alive, self.shown)
            for part in range(parts):
                back = (part + 0.5) / parts * kind.length
                places = np.zeros((len(alive), 3))
                places[run] = motion.positions[run] - back * ahead
                places = _onward(places, alive) + np.array([0.0, 0.0, HEIGHT])
                name = f"{trajectory.id}/{trajectory.kind}/{part}"
                yield Source(name, places, there, each, own=own)


_CLOSED = frozenset(["1", "2", "3", "rail"])
"""Categories of vehicles with a cabin around who sits in them."""


def _runs(alive: Bools) -> Iterator[slice]:
    """Yield the stretches of samples at which somebody exists, of two samples at least."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], alive, [False]]).astype(np.int8)))
    for first, after in edges.reshape(-1, 2).tolist():
        if after - first > 1:
            yield slice(first, after)


def _presence(alive: Bools, shown: tuple[int, int]) -> Floats:
    """Return how much of somebody is there, (n,): it fades in and out within its time.

    Args:
        alive: When it exists, (n,): one stretch.
        shown: Numbers of the samples of the first and of the last picture.
    """
    from sumo3dviz_pt.sound.render import STEP

    steps = max(round(_FADE / STEP), 1)
    rows = np.flatnonzero(alive)
    first = -steps if rows[0] <= shown[0] else int(rows[0])
    last = len(alive) + steps if rows[-1] >= shown[1] else int(rows[-1])
    number = np.arange(len(alive))
    nearest = np.minimum(number - first, last - number) / steps
    share = np.clip(nearest, 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def _held(values: Floats, run: slice, count: int) -> Floats:
    """Return values of a stretch, and those of its ends before and after it, (n,)."""
    return np.pad(values, (run.start, count - run.stop), mode="edge")


def _evened(values: Floats) -> Floats:
    """Return means over half a second that weigh what is near more, (n,)."""
    from sumo3dviz_pt.sound.render import STEP

    reach = round(_EVEN / STEP)
    weights = np.bartlett(2 * reach + 3)[1:-1]
    padded = np.pad(values, reach, mode="edge")
    return np.convolve(padded, weights / weights.sum(), mode="valid")


def _is_audible(source: Source, eyes: Floats, radius: float) -> bool:
    """Return whether a source is ever near enough and loud enough."""
    from sumo3dviz_pt.sound.emission import A_WEIGHTS
    from sumo3dviz_pt.sound.propagation import HALF_SPACE

    if source.own:
        return True
    away = np.maximum(np.linalg.norm(source.places - eyes, axis=1), 1.0)
    power = (10.0 ** (0.1 * (source.emission.total + A_WEIGHTS))).sum(axis=1)
    levels = 10.0 * np.log10(power) - HALF_SPACE - 20.0 * np.log10(away)
    return bool(((away <= radius) & (source.there > 0.0) & (levels > _FAINTEST)).any())


# What is all around ------------------------------------------------------------------------


def _beds(production: Production, wanted: SoundSettings, times: Floats) -> Iterator[Bed]:
    """Yield what sounds from everywhere."""
    from sumo3dviz_pt.sound.render import Bed, bed_levels

    if wanted.murmur is not None:
        yield Bed("murmur", bed_levels(_MURMUR, np.full(len(times), wanted.murmur)))
    weather = production.shot.data.weather
    if weather is None or not weather.rains:
        return
    moments = [weather.at(at).rain for at in times.tolist()]
    rates = np.array([0.0 if rain is None else rain.rate for rain in moments])
    levels = _RAIN_LEVEL + _RAIN_SLOPE * np.log10(np.maximum(rates, 1e-6))
    yield Bed("rain", bed_levels(_RAIN, levels))
