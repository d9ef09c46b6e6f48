"""What pictures and stored frames show: light, clutter, shares of things, bodies that are hidden.

A film's pictures are measured as they are seen, and the light of the scene behind them. A display
is assumed: its white has a luminance that the study file says, its curve is sRGB's. Then luminance
is white x (0.2126 R + 0.7152 G + 0.0722 B) of decoded channels. RMS contrast is the standard
deviation of luminance over its mean. Motion energy is the mean absolute change of luminance from
the frame before, per pixel: it holds what moves, the camera's own motion and noise.

In stored frames, the layer `instance` says which thing the central ray of each pixel meets first.
From it come shares of things, how much of a body is hidden, and gaze. Rain, fog and overlays hide
nothing.

* visible share: pixels that show a thing, over all pixels of the frame. It tells how large a thing
  is seen: what hides behind others, or lies beyond the edge of the picture, does not count, and it
  is not the share of the thing that is visible. A thing that is thinner than a pixel counts by the
  rays that meet it;
* seen: the share of a road user's body that nothing hides. Of the pixels whose rays meet its box
  (the size of its vehicle type), those that show it, over those that show it or something nearer
  than the box. So a body alone has 1, whatever room its box leaves; what lies beyond the picture's
  edge does not count, and what hides an empty corner of the box counts as if it hid the body.

References:
    IEC 61966-2-1 (sRGB); Peli, "Contrast in complex images", JOSA A 7, 1990,
    doi:10.1364/JOSAA.7.002032 (RMS contrast).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.metrics import edge_density
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.layers import LUMINANCE, Thing, linear_from_srgb, number_of
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.films.layers import beside, said_file
from sumo3dviz_pt.pipeline.films.stored_layers import FrameLayers, read_frame
from sumo3dviz_pt.studies.certificate.acts import matches
from sumo3dviz_pt.studies.certificate.evidence import COUNTED
from sumo3dviz_pt.studies.measured.observer import Seen
from sumo3dviz_pt.studies.measured.traffic import Row as TrafficRow
from sumo3dviz_pt.studies.measured.traffic import Traffic
from sumo3dviz_pt.world.signals.signals import GLASS

_LINEAR = np.array([linear_from_srgb(code / 255.0) for code in range(256)])
"""Linear light of each 8-bit code."""

_ENDS = (1, 99)
"""Percentiles that are told of luminance."""

Row = dict[str, float]


def picture_rows(pictures: Iterable[NDArray[np.uint8]], *, white: float) -> Iterator[Row]:
    """Yield what each picture of a film measures, in order.

    Args:
        pictures: Of the film, (h, w, 3), sRGB codes.
        white: Luminance of the display's white [cd/m2].
    """
    before: Floats | None = None
    for picture in pictures:
        shown = white * (_LINEAR[picture] @ LUMINANCE)
        mean = float(shown.mean())
        yield {
            **_spread("shown", shown),
            "shown_peak": float(shown.max()),
            "contrast": float(shown.std()) / mean if mean > 0.0 else 0.0,
            "motion_energy": float("nan")
            if before is None
            else float(np.abs(shown - before).mean()),
            "clutter": edge_density(_luma(picture)),
        }
        before = shown


def scene_row(film: Path, number: int) -> Row:
    """Return the luminance of the scene in a stored frame [cd/m2]; NaN if the frame is gone.

    The frame is taken as it was traced: with few samples, noise widens the percentiles.

    Args:
        film: The film.
        number: The frame's.

    Raises:
        InputError: If the frame is damaged.
    """
    from sumo3dviz_pt.image.exr import read_layers

    path = frame_file(frames_folder(film), number)
    if not path.is_file():
        return _spread("scene", np.array([np.nan]))
    layers, _ = read_layers(path)
    # Light of lamps that are seen directly is stored apart where frames help each other.
    radiance = layers["radiance"] + layers.get("excess", np.float32(0.0))
    return _spread("scene", CANDELAS_PER_UNIT * (radiance.astype(np.float64) @ LUMINANCE))


def _spread(name: str, luminance: Floats) -> Row:
    """Return mean and ends of luminances, under names that begin with a word."""
    low, high = np.percentile(luminance, _ENDS)
    return {
        f"{name}_mean": float(luminance.mean()),
        f"{name}_p1": float(low),
        f"{name}_p99": float(high),
    }


def _luma(picture: NDArray[np.uint8]) -> Floats:
    """Return encoded luma, (h, w) in [0, 1]."""
    return np.asarray((picture / 255.0) @ LUMINANCE)


_NEARER = 0.05
"""What lies so much before a body's box hides it [m]."""


_SAME_GLASS = 1e-3
"""Reflectances are stored in half precision."""

_ASPECTS: Mapping[str, tuple[str, ...]] = {
    **{"r": ("red",), "s": ("red",), "u": ("red", "yellow"), "y": ("yellow",), "g": ("green",)}
}
"""Which lamps shine, by SUMO's letter in lower case; blinking ones are not told."""


@dataclass(frozen=True, slots=True)
class Shown:
    """What the frames of a film show, as far as they have layers.

    Attributes:
        shares: A row for each class and named thing of each frame.
        seen: Of each frame's road users, how much is not hidden, and pixels.
        lenses: Which pixels show lenses of traffic lights that shine, by frame and by names in
            `GLASS`, as numbers in the flattened picture.
    """

    shares: tuple[TrafficRow, ...]
    seen: Seen
    lenses: Mapping[int, Mapping[str, Ints]]


def shown_in(
    film: Path, account: Mapping[str, Any], traffic: Traffic, *, named: Sequence[str], within: float
) -> Shown:
    """Return what a film's frames show; nothing of those without layers.

    Args:
        film: The film.
        account: The film's.
        traffic: Everyone, at the frames' times.
        named: Patterns of names of things whose shares are told.
        within: Of which road users it is told how much is hidden: so near [m].

    Raises:
        InputError: If layers are damaged.
    """
    folder = beside(frames_folder(film))
    shares: list[TrafficRow] = []
    seen: dict[tuple[int, str], tuple[float, int]] = {}
    lenses: dict[int, Mapping[str, Ints]] = {}
    states = _states(account)
    for number, frame in enumerate(account["frames"]):
        if said_file(folder, number).is_file():
            layers = read_frame(folder, number)
            shares += share_rows(layers, named)
            lenses[number] = shining_lenses(layers, states[number])
            if "depth" in layers.layers and COUNTED in layers.layers:
                lens = lens_of(frame["camera"])
                if lens.has_one_centre:
                    seen |= _seen(layers, lens, traffic, number, within=within)
    return Shown(tuple(shares), seen, lenses)


def share_rows(frame: FrameLayers, named: Sequence[str]) -> Iterator[TrafficRow]:
    """Yield the visible share of each class and of named things in a frame.

    Args:
        frame: Its layers.
        named: Patterns of names of things that are told apart.
    """
    numbers, counts = np.unique(frame.layers[COUNTED], return_counts=True)
    things: dict[str, int] = {}
    classes: dict[str, int] = {}
    for key, pixels in zip(numbers.tolist(), counts.tolist(), strict=True):
        thing = frame.things.get(int(key))
        name, label = ("sky", "sky") if thing is None else (thing.name, thing.label)
        classes[label] = classes.get(label, 0) + pixels
        if matches(named, name, label):
            things[name] = things.get(name, 0) + pixels
    whole = int(counts.sum())
    for kind, some in (("class", classes), ("thing", things)):
        for name, pixels in sorted(some.items()):
            share = round(pixels / whole, 6)
            yield {"frame": frame.frame, "kind": kind, "name": name, "share": share}


def _states(account: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return the state of each traffic light in each frame, as SUMO's letters by link."""
    changes: dict[int, dict[str, str]] = {}
    for change in account["signal_changes"]:
        changes.setdefault(int(change["frame"]), {})[str(change["tls"])] = str(change["state"])
    states: list[dict[str, str]] = []
    for number in range(len(account["frames"])):
        states.append({**(states[-1] if states else {}), **changes.get(number, {})})
    return states


def shining_lenses(frame: FrameLayers, states: Mapping[str, str]) -> dict[str, Ints]:
    """Return which pixels show a lens that shines, by the lens's colour; none by guess.

    Args:
        frame: Its layers; without albedo nothing is known.
        states: Of traffic lights, letters by link.
    """
    if "albedo" not in frame.layers:
        return {}
    lenses: dict[str, list[Ints]] = {name: [] for name in GLASS}
    for key, thing in frame.things.items():
        for name in _aspects(thing, states):
            places = np.flatnonzero(frame.layers[COUNTED] == key)
            albedo = frame.layers["albedo"].reshape(-1, 3)[places]
            glass = np.array(GLASS[name], dtype=np.float32)
            lenses[name].append(places[(np.abs(albedo - glass) < _SAME_GLASS).all(axis=1)])
    return {name: np.concatenate(some) for name, some in lenses.items() if some}


def _aspects(thing: Thing, states: Mapping[str, str]) -> tuple[str, ...]:
    """Return which lamps of a signal head shine; its name has its light, link and number."""
    if thing.label != "traffic light" or not thing.name.startswith("signal:"):
        return ()
    light, _, link = thing.name.removeprefix("signal:").rpartition("/")[0].rpartition("/")
    letters = states.get(light, "")
    known = link.isdecimal() and int(link) < len(letters)
    return _ASPECTS.get(letters[int(link)].lower(), ()) if known else ()


# What hides bodies --------------------------------------------------------------------------


def lens_of(camera: Mapping[str, Any]) -> Lens:
    """Return the lens that an account says."""
    lens = {"opening": float(np.radians(camera["fov"])), **camera.get("lens", {})}
    return Lens.from_dict(lens)


def _seen(
    layers: FrameLayers, lens: Lens, traffic: Traffic, number: int, *, within: float
) -> dict[tuple[int, str], tuple[float, int]]:
    """Return how much of each near road user nothing hides in a frame, and its pixels."""
    pose = layers.camera.world_from_camera.matrix
    rays = lens.rays(layers.camera.size)
    shares = {}
    for k in np.flatnonzero(traffic.alive[:, number]).tolist():
        front, yaw = traffic.fronts[k, number], float(traffic.yaws[k, number])
        away = np.linalg.norm(front - pose[:3, 3])
        if away > within + traffic.sizes[k, 0] or traffic.keys[k] == traffic.ridden:
            continue
        cos, sin = np.cos(yaw), np.sin(yaw)
        world_from_body = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        body_from_camera = world_from_body.T @ pose[:3, :3]
        eye = world_from_body.T @ (pose[:3, 3] - front)
        length, width, height = traffic.sizes[k]
        low, high = np.array([-length, -width / 2.0, 0.0]), np.array([0.0, width / 2.0, height])
        part = _part(lens, layers.camera.size, (low, high), eye, body_from_camera)
        near, meets = box_entries(eye, rays[part] @ body_from_camera.T, low, high)
        own = layers.layers[COUNTED][part] == number_of(traffic.keys[k])
        depth = layers.layers["depth"][part]
        hidden = meets & ~own & (depth > 0.0) & (depth < near - _NEARER)
        shown = int((own & meets).sum())
        pixels = int((layers.layers[COUNTED] == number_of(traffic.keys[k])).sum())
        if shown + int(hidden.sum()):
            share = round(shown / (shown + int(hidden.sum())), 4)
            shares[(number, traffic.keys[k])] = (share, pixels)
    return shares


def _part(
    lens: Lens,
    size: tuple[int, int],
    box: tuple[Floats, Floats],
    eye: Floats,
    body_from_camera: Floats,
) -> tuple[slice, slice]:
    """Return rows and columns that hold a box: none of one behind the eye, all if it is beside."""
    corners = np.stack(np.meshgrid(*np.stack(box, axis=1), indexing="ij"), axis=-1).reshape(-1, 3)
    points = (corners - eye) @ body_from_camera
    places, ahead = lens.project(points, size)
    if lens.is_straight and not ahead.any():
        return slice(0), slice(0)
    if not (lens.is_straight and ahead.all()):
        return slice(None), slice(None)
    first = np.maximum(np.floor(places.min(axis=1)), 0.0)
    after = np.minimum(np.ceil(places.max(axis=1)) + 1.0, (size[1], size[0]))
    (row, column), (below, right) = first.astype(int).tolist(), after.astype(int).tolist()
    return slice(row, max(below, row)), slice(column, max(right, column))


def box_entries(eye: Floats, rays: Floats, low: Floats, high: Floats) -> tuple[Floats, Bools]:
    """Return how far away rays enter a box, and which do; of an eye in it, at 0 m.

    Args:
        eye: In the box's frame, (3,) [m].
        rays: Unit, (..., 3).
        low: Its lowest corner, (3,) [m].
        high: Its highest corner, (3,) [m].
    """
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        one, other = (low - eye) / rays, (high - eye) / rays
    # A ray along a face is in its slab, or 0 / 0, for ever.
    near = np.nan_to_num(np.minimum(one, other), nan=-np.inf).max(axis=-1)
    far = np.nan_to_num(np.maximum(one, other), nan=np.inf).min(axis=-1)
    return np.maximum(near, 0.0), (near <= far) & (far > 0.0)
