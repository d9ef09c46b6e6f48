"""Makes road users of samples: what each one is, how large, where its front is, where it heads.

SUMO logs the middle of the front bumper at common times. Other tools log the middle of the body, at
times of their own, and often no heading: that follows the way that is driven then, and is kept
while somebody stands.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.traffic import GAP_FACTOR
from sumo3dviz_pt.sumo.guesses import class_of_type
from sumo3dviz_pt.sumo.tracks.readings import Samples
from sumo3dviz_pt.sumo.types import ALL_CLASSES, CLASS_DEFAULTS
from sumo3dviz_pt.sumo.values import BODY_LENGTH, BODY_WIDTH

_ON_FOOT = frozenset({"pedestrian", "wheelchair"})

_BY_LENGTH = (
    # Longest, and what it is: bodies of more are trailers.
    (5.7, "passenger"),
    (7.5, "delivery"),
    (13.0, "truck"),
)
_SMALL = 2.7  # no car is shorter [m]
_WALK, _CYCLE = 3.5, 12.0  # largest speeds on foot and by bicycle [m/s]
_STROLL = 2.6  # who never moves faster, though more than a few metres, is on foot [m/s]
_FAR = 8.0

_LEAST_BEHIND = 0.4  # a body follows no point that is nearer to its rear axle [m]

_SPLIT = 3.5
"""Samples that are more than so many usual steps apart belong to two stays."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One road user.

    Attributes:
        id: As the file has it.
        vclass: SUMO's vClass.
        size: Length, width and height [m].
        times: Increasing, (n,) [s].
        fronts: The middle of the front, (n, 3) [m].
        headings: Counter-clockwise from east, (n,) [rad].
        speeds: NaN where nothing tells, (n,) [m/s].
    """

    id: str
    vclass: str
    size: tuple[float, float, float]
    times: Floats
    fronts: Floats
    headings: Floats
    speeds: Floats

    @property
    def kind(self) -> str:
        """What SUMO calls it: `vehicle` or `person`."""
        return "person" if self.vclass in _ON_FOOT else "vehicle"


def tracks_of(samples: Samples) -> tuple[Track, ...]:
    """Return the road users that samples tell, at common times."""
    order = np.lexsort((samples.times, samples.who.codes))
    codes = samples.who.codes[order]
    starts = np.flatnonzero(np.diff(codes, prepend=-1))
    parts = np.split(order, starts[1:])
    tracks = [track for rows in parts if (track := _track(samples, rows)) is not None]
    return tuple(_at_common_times(tracks))


def note_of_classes(samples: Samples, tracks: Sequence[Track]) -> list[str]:
    """Say what road users were taken for, where nothing tells their classes."""
    if samples.classes is not None or not samples.columns:
        return []
    counts = Counter(track.vclass for track in tracks)
    taken = ", ".join(f"{count} for {vclass}" for vclass, count in counts.most_common())
    by = "length and speed" if np.isfinite(samples.sizes[:, 0]).any() else "speed alone"
    return [f"no column tells classes; by {by} {taken} are taken"]


def _track(samples: Samples, rows: Ints) -> Track | None:
    """Return the road user of some rows in order of time; None if it is nowhere."""
    known = np.isfinite(samples.times[rows]) & np.isfinite(samples.places[rows]).all(axis=1)
    rows = rows[known]
    rows = rows[np.diff(samples.times[rows], prepend=-np.inf) > 0.0]
    name = samples.who.texts[samples.who.codes[rows[0]]] if len(rows) else ""
    if not name:
        return None
    times, places = samples.times[rows], samples.places[rows]
    sizes = samples.sizes[rows]
    told = [
        float(np.median(each[np.isfinite(each)])) if np.isfinite(each).any() else 0.0
        for each in sizes.T
    ]
    word = (
        "" if samples.classes is None else _word(samples.classes.texts, samples.classes.codes[rows])
    )
    vclass = _named(word, samples.meanings) or _by_size(told[0], _fastest(times, places))
    size = _size(vclass, told)
    behind = max({"front": 0.8, "centre": 0.3, "rear": 0.0}[samples.point] * size[0], _LEAST_BEHIND)
    headings = _filled(samples.headings[rows], places, behind)
    ahead = {"front": 0.0, "centre": 0.5, "rear": 1.0}[samples.point] * size[0]
    shift = ahead * np.column_stack([np.cos(headings), np.sin(headings), np.zeros(len(rows))])
    return Track(name, vclass, size, times, places + shift, headings, samples.speeds[rows])


def _word(texts: Sequence[str], codes: Ints) -> str:
    """Return the word that most rows have for a road user's class."""
    values, counts = np.unique(codes, return_counts=True)
    return texts[int(values[np.argmax(counts)])]


def _named(word: str, meanings: Mapping[str, str]) -> str | None:
    """Return the vClass that a word means, or None."""
    meant = meanings.get(word, meanings.get(word.removesuffix(".0"), word))
    low = meant.lower().strip()
    return low if low in ALL_CLASSES else class_of_type(meant, "vehicle")


def _by_size(length: float, fastest: float) -> str:
    """Return the vClass that a length [m], 0 if unknown, and the largest speed [m/s] tell."""
    if not length:
        return "pedestrian" if 0.0 < fastest <= _STROLL else "passenger"
    if length < _SMALL:
        small = (_WALK, "pedestrian"), (_CYCLE, "bicycle")
        own = next((vclass for most, vclass in small if fastest <= most), "motorcycle")
        return "bicycle" if own == "pedestrian" and length > 1.2 else own
    return next((vclass for most, vclass in _BY_LENGTH if length <= most), "trailer")


def _fastest(times: Floats, places: Floats) -> float:
    """Return the largest speed over about a second [m/s]; 0 of who moves a few metres at most."""
    if len(times) < 2 or float(np.ptp(places[:, :2], axis=0).max()) < _FAR:
        return 0.0
    later = np.minimum(np.searchsorted(times, times + 1.0), len(times) - 1)
    spans = np.maximum(times[later] - times, 1e-9)
    ways = np.linalg.norm(places[later, :2] - places[:, :2], axis=1)
    return float(np.max(np.where(spans >= 0.5, ways / spans, 0.0)))


def _size(vclass: str, told: Sequence[float]) -> tuple[float, float, float]:
    """Return length, width and height [m]: as told, to a decimetre, or as SUMO has them."""
    usual = CLASS_DEFAULTS[vclass]
    bounds = (BODY_LENGTH, BODY_WIDTH, BODY_WIDTH)
    pairs = zip(told, (usual.length, usual.width, usual.height), bounds, strict=True)
    own = [
        round(size, 1) if round(size, 1) in within and size else most
        for size, most, within in pairs
    ]
    return own[0], own[1], own[2]


def _filled(headings: Floats, places: Floats, behind: float) -> Floats:
    """Return headings, (n,) [rad]; where none is told, those of a body that follows its way.

    Args:
        headings: As told, NaN where nothing is, (n,) [rad].
        places: (n, 3) [m].
        behind: Distance of the rear axle behind these [m].
    """
    known = np.isfinite(headings)
    if not known.any():
        return _dragged(places, behind)
    at = np.arange(len(headings))
    return np.asarray(np.interp(at, at[known], np.unwrap(headings[known])))


def _dragged(places: Floats, behind: float) -> Floats:
    """Return the headings of a body whose rear axle is dragged along behind a point, (n,) [rad].

    Args:
        places: The point, (n, 3) [m].
        behind: Distance of the axle [m].
    """
    away = np.linalg.norm(places[:, :2] - places[0, :2], axis=1)
    far = np.flatnonzero(away >= behind)
    first = places[far[0] if len(far) else int(np.argmax(away)), :2] - places[0, :2]
    ahead = complex(*first) / max(abs(complex(*first)), 1e-9) or 1.0 + 0.0j
    points = (places[:, 0] + 1j * places[:, 1]).tolist()
    axle = points[0] - behind * ahead
    headings = []
    for point in points:
        way = point - axle
        ahead = way / abs(way) if abs(way) > 1e-9 else ahead
        axle = point - behind * ahead
        headings.append(ahead)
    return np.asarray(np.angle(np.array(headings)))


def _at_common_times(tracks: list[Track]) -> Iterator[Track]:
    """Yield tracks at times that are multiples of the usual step, unless they all have such."""
    if not tracks:
        return
    spans = np.concatenate([np.diff(track.times) for track in tracks])
    if not len(spans):
        yield from tracks
        return
    step = float(np.median(spans))
    together = np.unique(np.round(np.concatenate([track.times for track in tracks]), 4))
    common = float(np.median(np.diff(together))) if len(together) > 1 else step
    if np.mean(spans > GAP_FACTOR * common) < 0.5:
        yield from (_closed(track, common) for track in tracks)
        return
    for track in tracks:
        resampled = _resampled(track, step)
        if resampled is not None:
            yield resampled


def _closed(track: Track, step: float) -> Track:
    """Return a track with the few samples that are missing in it, such as where a cell is empty."""
    spans = np.diff(track.times)
    missing = np.flatnonzero((spans > GAP_FACTOR * step) & (spans < _SPLIT * step))
    if not len(missing):
        return track
    more = [
        np.linspace(track.times[at], track.times[at + 1], round(spans[at] / step) + 1)[1:-1]
        for at in missing
    ]
    return _at(track, np.sort(np.concatenate([track.times, *more])))


def _at(track: Track, times: Floats) -> Track:
    """Return a track of two samples or more at other times between them [s]."""
    from scipy.interpolate import PchipInterpolator

    fronts: Floats = np.asarray(PchipInterpolator(track.times, track.fronts)(times))
    headings = np.interp(times, track.times, np.unwrap(track.headings))
    speeds = np.interp(times, track.times, track.speeds)
    return replace(track, times=times, fronts=fronts, headings=headings, speeds=speeds)


def _resampled(track: Track, step: float) -> Track | None:
    """Return a track at multiples of a step [s], none of them in gaps; None if there are none."""
    first, last = track.times[[0, -1]]
    times = np.arange(np.ceil(first / step - 1e-6), np.floor(last / step + 1e-6) + 1) * step
    times = np.clip(times, first, last)
    times = times[_in_no_gap(times, track.times, _SPLIT * step)]
    if not len(times):
        return None
    return _at(track, times) if len(track.times) > 1 else replace(track, times=times)


def _in_no_gap(times: Floats, known: Floats, longest: float) -> Bools:
    """Return which times lie between samples that are not too far apart, (n,)."""
    after = np.clip(np.searchsorted(known, times), 1, max(len(known) - 1, 1))
    if len(known) < 2:
        return np.ones(len(times), dtype=np.bool_)
    gaps = known[after] - known[after - 1]
    return np.asarray(gaps <= longest)
