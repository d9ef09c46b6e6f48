"""Gathers what a film's overlays show, and writes the files of a film that has them.

Overlays show views, road users, their ways, and the lanes of the map.

`drive.mp4` has overlays, `drive.plain.mp4` has none: it is what was rendered, from the shot's first
frame to its last. Pictures go to both at once, because finishing them costs more than encoding them
twice. Captions lie beside the film. `overlays.json` lies beside the frames, so that `develop` draws
the same.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from fnmatch import fnmatchcase
from pathlib import Path
from queue import Full, Queue
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.errors import InputError, RenderError
from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.job.overlays import OverlaySettings
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.pipeline.films.frames import film_name
from sumo3dviz_pt.pipeline.films.sound import Nearby, nearby

if TYPE_CHECKING:
    from sumo3dviz_pt.cast.fleet import Fleet
    from sumo3dviz_pt.overlays.drawing import ShownUsers
    from sumo3dviz_pt.overlays.facts import FilmFacts, FrameFacts
    from sumo3dviz_pt.pipeline.production import Production


Writer = Callable[[Iterable[Image]], Any]

_AHEAD = 2  # pictures that the first writer may be ahead of the second
_PATIENCE = 0.5  # after which it is asked whether the second has failed [s]

_Handed = Image | BaseException | None


def write_both(pictures: Iterable[Image], first: Writer, second: Writer) -> None:
    """Hand every picture to two writers, in memory that does not grow.

    Args:
        pictures: Each is made once.
        first: Takes them all, here.
        second: Takes them all, in a thread of its own.

    Raises:
        Exception: What a writer raises; the other one is stopped by an error, too, so that neither
            leaves half a film.
    """
    handed: Queue[_Handed] = Queue(maxsize=_AHEAD)
    with ThreadPoolExecutor(max_workers=1) as pool:
        twin = pool.submit(second, _taken(handed))
        try:
            first(_handing(pictures, handed, twin))
        except BaseException:
            _put(handed, RenderError("the film beside it failed"), twin)
            raise
        _put(handed, None, twin)
        twin.result()


def _taken(handed: Queue[_Handed]) -> Iterator[Image]:
    """Yield what is handed over, until its end."""
    while (item := handed.get()) is not None:
        if isinstance(item, BaseException):
            raise item
        yield item


def _handing(
    pictures: Iterable[Image], handed: Queue[_Handed], twin: Future[Any]
) -> Iterator[Image]:
    """Yield pictures and hand each over."""
    for picture in pictures:
        _put(handed, picture, twin)
        if twin.done():
            twin.result()
            raise RenderError("the film without overlays ended too early")
        yield picture


def _put(handed: Queue[_Handed], item: _Handed, twin: Future[Any]) -> None:
    """Hand something over, unless nobody takes it any more."""
    while not twin.done():
        try:
            handed.put(item, timeout=_PATIENCE)
            return
        except Full:
            continue


log = logging.getLogger(__name__)

_TRAIL_STEP = 0.1  # between points of a trail [s]
_CORNERS = 1.5  # how far the corners of a map are, in its radii
_ON_FOOT = frozenset({"walkingarea", "crossing"})


def film_facts(production: Production, wanted: OverlaySettings, *, rate: float) -> FilmFacts:
    """Return what a film's overlays show.

    Args:
        production: The film's.
        wanted: The overlays.
        rate: Frames per second.
    """
    from sumo3dviz_pt.cast.fleet import find_rider
    from sumo3dviz_pt.overlays.facts import FilmFacts

    # Say which ids mean nobody; find whom the camera rides with, and where it is.
    for pattern in unknown_ids(wanted, production.shot.fleet.keys):
        log.warning("overlays: nobody near the camera of this film is called %s", pattern)
    job, fleet = production.job, production.shot.fleet
    camera = job.cameras[production.camera]
    ridden = find_rider(fleet, camera.rides_with).key if camera.rides_with else ""
    views = [production.shot.frame_at(at).view for at in production.times.tolist()]
    around = _around(production, views, wanted)
    frames = [
        _frame(production, at, view, reach=_reach(wanted), ridden=ridden, around=around)
        for at, view in zip(production.times.tolist(), views, strict=True)
    ]
    lanes, widths = ([], []) if around is None else _lanes(around.network, views, wanted)
    return FilmFacts(
        wanted,
        job.output.size,
        rate,
        fleet.keys,
        fleet.sizes,
        ridden,
        frames,
        _paths(fleet, production.times, wanted),
        lanes,
        widths,
        inside=bool(ridden) and bool(views[0].rides_in),
    )


def unknown_ids(wanted: OverlaySettings, keys: Sequence[str]) -> list[str]:
    """Return the ids and patterns of overlays that mean none of some road users.

    Args:
        wanted: The overlays.
        keys: Of road users.
    """
    from sumo3dviz_pt.overlays.facts import named

    groups = [each.ids for each in wanted.labels]
    groups += [each.ids for each in wanted.highlights]
    groups += [each.ids for each in wanted.trails]
    patterns = dict.fromkeys(pattern for group in groups for pattern in group)
    names = [*keys, *map(named, keys)]
    return [each for each in patterns if not any(fnmatchcase(name, each) for name in names)]


def _reach(wanted: OverlaySettings) -> float:
    """Return how far the farthest road users are that an overlay may be about [m]."""
    from sumo3dviz_pt.overlays.drawing import TRAIL_REACH

    reaches = [each.reach for each in wanted.labels]
    reaches += [each.reach for each in wanted.highlights]
    reaches += [TRAIL_REACH] if wanted.trails else []
    reaches += [wanted.dots.reach] if wanted.dots else []
    return max(reaches, default=0.0)


def _frame(
    production: Production,
    at: float,
    view: View,
    *,
    reach: float,
    ridden: str,
    around: Nearby | None,
) -> FrameFacts:
    """Return what one frame shows."""
    from sumo3dviz_pt.overlays.facts import FrameFacts

    present, fleet = production.shot.present_at(at), production.shot.fleet
    poses = np.column_stack([present.positions, present.yaws, present.pitches, present.speeds])
    keep = np.linalg.norm(poses[:, :3] - view.position, axis=1) <= reach
    # A speed may be asked for whoever it is of.
    speed = production.job.overlays and production.job.overlays.speed
    shown = {ridden, *((speed.vehicle, f"vehicle:{speed.vehicle}") if speed else ())}
    keep |= np.array([fleet.keys[user] in shown for user in present.users.tolist()], dtype=bool)
    return FrameFacts(at, view, present.users[keep], poses[keep], _map_rows(around, at))


# The map -----------------------------------------------------------------------------------


def _around(
    production: Production, views: Sequence[View], wanted: OverlaySettings
) -> Nearby | None:
    """Return the road users that come onto the map; None without a map."""
    if wanted.map is None:
        return None
    eyes = np.array([view.position for view in views])
    return nearby(production, eyes, radius=_CORNERS * wanted.map.radius)


def _map_rows(around: Nearby | None, at: float) -> Floats:
    """Return everyone on the map at a time, as `FrameFacts.around`."""
    rows = []
    everyone = zip(around.trajectories, around.types, strict=True) if around else ()
    for trajectory, kind in everyone:
        pose = trajectory.at(at)
        if pose is not None:
            x, y, _ = pose.position
            rows.append([x, y, pose.yaw, kind.length, kind.width, pose.speed])
    return np.array(rows, dtype=np.float64).reshape(-1, 6)


def _lanes(
    network: Network, views: Sequence[View], wanted: OverlaySettings
) -> tuple[list[Floats], list[float]]:
    """Return the centre lines of lanes on the map, (n, 2) each, and their widths [m]."""
    assert wanted.map is not None
    reach = _CORNERS * wanted.map.radius
    eyes = np.array([view.position[:2] for view in views])
    low, high = eyes.min(axis=0) - reach, eyes.max(axis=0) + reach
    lines: list[Floats] = []
    widths: list[float] = []
    for edge in network.edges.values():
        for lane in () if edge.function in _ON_FOOT else edge.lanes:
            line = lane.shape[:, :2]
            if (line.max(axis=0) >= low).all() and (line.min(axis=0) <= high).all():
                lines.append(line)
                widths.append(lane.width)
    return lines, widths


# Trails ------------------------------------------------------------------------------------


def _paths(fleet: Fleet, times: Floats, wanted: OverlaySettings) -> Mapping[str, Floats]:
    """Return where road users with trails drove, as `FilmFacts.paths`."""
    if not wanted.trails:
        return {}
    back = max(trail.seconds for trail in wanted.trails)
    steps = np.arange(times[0] - back, times[-1] + _TRAIL_STEP, _TRAIL_STEP)
    patterns = [pattern for trail in wanted.trails for pattern in trail.ids]
    ways = {}
    for trajectory in fleet.trajectories:
        names = (trajectory.id, trajectory.key)
        if any(fnmatchcase(name, pattern) for pattern in patterns for name in names):
            motion = trajectory.sample(steps)
            points = np.column_stack([steps, motion.positions, motion.speeds])
            ways[trajectory.key] = points[motion.alive]
    return ways


FACTS = "overlays.json"
"""What overlays show, beside the frames."""

_LEAST_SHARE = 1e-5
"""Share of a picture that shows a road user which is not hidden."""


def plain_twin(path: Path) -> Path:
    """Return where a film without overlays goes, by the name of the one that has them."""
    return path.with_name(f"{path.stem}.plain{path.suffix}")


def captions_file(path: Path) -> Path:
    """Return where a film's captions go."""
    return film_name(path).with_suffix(".vtt")


def extra_files(path: Path, wanted: OverlaySettings | None) -> list[Path]:
    """Return the files that overlays put beside a film; none without overlays."""
    if wanted is None:
        return []
    return [plain_twin(path), *([captions_file(path)] if wanted.captions else [])]


def extra_frames(wanted: OverlaySettings | None, rate: float) -> tuple[int, int]:
    """Return how many frames overlays put before and after a film.

    Args:
        wanted: The overlays, or None.
        rate: Frames per second.
    """
    if wanted is None:
        return 0, 0
    from sumo3dviz_pt.overlays.canvas import still_count

    return still_count(wanted.before, rate), still_count(wanted.after, rate)


def read_facts(folder: Path) -> FilmFacts | None:
    """Return what the overlays of stored frames show; None where they have none.

    Raises:
        InputError: If the file is damaged.
    """
    path = folder / FACTS
    if not path.is_file():
        return None
    from sumo3dviz_pt.overlays.facts import facts_of

    try:
        return facts_of(path.read_bytes())
    except ValueError as error:
        raise InputError(f"{error}; render the film again", file=path) from error


def overlaid(
    pictures: Iterable[Image], files: Iterable[Path], film: FilmFacts, *, whole: bool
) -> Iterator[Image]:
    """Yield pictures with their overlays.

    Args:
        pictures: Of stored frames, (h, w, 3) in [0, 1].
        files: These frames.
        film: What overlays show.
        whole: Whether what stands before and after the film is yielded, too.
    """
    from sumo3dviz_pt.overlays.canvas import still_frames
    from sumo3dviz_pt.overlays.drawing import drawn, hides

    if whole:
        yield from still_frames(film.settings.before, film)
    for picture, file in zip(pictures, files, strict=True):
        number = number_of(file, film)
        yield drawn(picture, film, number, shown_in(file) if hides(film) else None)
    if whole:
        yield from still_frames(film.settings.after, film)


def note_overlays(folder: Path, production: Production, *, rate: float) -> None:
    """Write what a film's overlays show beside its frames; what lay there goes if it has none.

    Args:
        folder: Of the frames.
        production: The film's.
        rate: Its frames per second.
    """
    path = folder / FACTS
    if production.job.overlays is None:
        path.unlink(missing_ok=True)
        return
    from sumo3dviz_pt.overlays.facts import facts_text

    write_atomically(path, facts_text(film_facts(production, production.job.overlays, rate=rate)))


def write_captions(film: FilmFacts, path: Path) -> None:
    """Write the captions of a film beside it, if it has any."""
    if film.settings.captions:
        from sumo3dviz_pt.overlays.canvas import captions_text

        write_atomically(captions_file(path), captions_text(film.settings.captions, film))


def number_of(file: Path, film: FilmFacts) -> int:
    """Return a stored frame's number in its film.

    Raises:
        InputError: If the film has no such frame.
    """
    number = int(file.stem) if file.stem.isdecimal() else -1
    if not 0 <= number < len(film.frames):
        raise InputError("is no frame of the film that its overlays are of", file=file)
    return number


def shown_in(file: Path) -> ShownUsers | None:
    """Return whom a stored frame shows; None where it does not tell.

    Raises:
        InputError: If it is missing or damaged.
    """
    import numpy as np

    from sumo3dviz_pt.image.traced import unpacked
    from sumo3dviz_pt.overlays.drawing import ShownUsers
    from sumo3dviz_pt.pipeline.films.traced import TRACED, StoredFrame

    stored = StoredFrame.read(file)
    if not stored.traced:
        return None
    try:
        frame = unpacked(stored.layers, stored.strings[TRACED])
    except ValueError as error:
        raise InputError(f"{error}; render it again", file=file) from error
    ids = np.squeeze(frame.layers["ids"]).astype(np.int64)
    pixels: dict[str, int] = {}
    for number, count in enumerate(np.bincount(ids.ravel(), minlength=1)[1:].tolist()):
        key = frame.parts[number].name.rpartition("/")[0]
        pixels[key] = pixels.get(key, 0) + count
    least = max(_LEAST_SHARE * ids.size, 1.0)
    return ShownUsers(frozenset(key for key, count in pixels.items() if count >= least), ids > 0)
