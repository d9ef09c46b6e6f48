"""Layers beside a picture: boxes, Cryptomatte, optical flow, and files of numbers.

Boxes lie around things in the picture, and around bodies in space. Cryptomatte is ids with
coverage, by which compositing programs pick things. Optical flow says where everything that a
frame's pixels show is in the next frame's picture. Classes and flow are PNG files of numbers. They
are no pictures, so no colours are said of them.

References:
    PNG specification, third edition: https://www.w3.org/TR/png-3/
    Menze and Geiger, "Object Scene Flow for Autonomous Vehicles", CVPR 2015,
        doi:10.1109/CVPR.2015.7298925; the form of files as in the KITTI development kit
        (https://www.cvlibs.net/datasets/kitti/eval_scene_flow.php).
    Friedman and Jones, "Fully automatic ID mattes with support for motion blur and transparency",
        SIGGRAPH 2015 posters, doi:10.1145/2787626.2787629.
    Cryptomatte specification 1.2.0 (https://github.com/Psyop/Cryptomatte).
    Lin et al., "Microsoft COCO: Common Objects in Context", ECCV 2014,
        doi:10.1007/978-3-319-10602-1_48; form of files: https://cocodataset.org/#format-data.
    Geiger, Lenz and Urtasun, "Are we ready for Autonomous Driving? The KITTI Vision Benchmark
        Suite", CVPR 2012, doi:10.1109/CVPR.2012.6248074; form of labels as in its development kit.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.atomic import atomic_path
from sumo3dviz_pt.image.png import SIGNATURE, chunk
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints, Transform
from sumo3dviz_pt.model.layers import LABELS, murmur3
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View

_UP = 2
"""The filter that all rows have: differences from the row above."""

_LEVEL = 6


def write_numbers(path: Path, numbers: NDArray[Any]) -> None:
    """Write numbers; a half-written file never stays.

    Args:
        path: Where to.
        numbers: (h, w) or (h, w, 3), of 8 or 16 bits without a sign.

    Raises:
        ValueError: If they are of another kind.
        OSError: If the file cannot be written.
    """
    if numbers.dtype not in (np.uint8, np.uint16) or numbers.shape[2:] not in ((), (3,)):
        raise ValueError(f"cannot store {numbers.shape} {numbers.dtype} as PNG")
    height, width = numbers.shape[:2]
    bits, kind = 8 * numbers.dtype.itemsize, 2 if numbers.ndim == 3 else 0
    rows = _bytes_of(numbers).reshape(height, -1)
    rows[1:] = rows[1:] - rows[:-1]
    data = np.concatenate([np.full((height, 1), _UP, np.uint8), rows], axis=1).tobytes()
    content = [
        chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)),
        chunk(b"IDAT", zlib.compress(data, _LEVEL)),
        chunk(b"IEND", b""),
    ]
    with atomic_path(path) as part:
        part.write_bytes(SIGNATURE + b"".join(content))


def read_numbers(path: Path) -> NDArray[Any]:
    """Return the numbers of a file that `write_numbers` wrote, (h, w) or (h, w, 3).

    Raises:
        InputError: If it is missing, damaged or of another kind.
    """
    try:
        data = path.read_bytes()
        width, height, bits, kind = struct.unpack(">IIBB", data[16:26])
        (length,) = struct.unpack(">I", data[33:37])
        rows = np.frombuffer(zlib.decompress(data[41 : 41 + length]), np.uint8)
        rows = rows.reshape(height, -1)
        if not data.startswith(SIGNATURE) or not (rows[:, 0] == _UP).all():
            raise InputError("was not written by sumo3dviz_pt", file=path)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    except (struct.error, zlib.error, ValueError) as error:
        raise InputError("is no PNG, or a damaged one", file=path) from error
    whole_rows = np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8)
    numbers = whole_rows if bits == 8 else whole_rows.reshape(-1).view(">u2").astype(np.uint16)
    shape = (height, width, 3) if kind == 2 else (height, width)
    return np.ascontiguousarray(numbers.reshape(shape))


def _bytes_of(numbers: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the numbers' bytes, the higher ones first, as a new array."""
    order = numbers if numbers.dtype == np.uint8 else numbers.astype(">u2")
    return np.frombuffer(np.ascontiguousarray(order).tobytes(), np.uint8).copy()


_SCALE, _ZERO = 64.0, 2**15
_MOST = _ZERO / _SCALE - 1.0
"""Longer ways cannot be stored [px]."""


def flow_of(places: Floats, directions: Floats, sky: Bools, *, view: View) -> tuple[Image, Bools]:
    """Return how far everything moves in the picture, (h, w, 2) [px], and where that is known.

    Flow goes right and down. What leaves the picture, or is hidden in the next one, has flow, too;
    what gets behind the camera or moves farther than 511 px has none. The sky lies at infinity.

    Args:
        places: Where all that pixels show is in the next frame, (h, w, 3) [m].
        directions: World directions of the pixels' rays, unit, (h, w, 3).
        sky: Which pixels show the sky, (h, w).
        view: Of the next frame.
    """
    height, width = sky.shape
    distant = view.lens.at_infinity(directions)
    away = np.where(sky[..., None], distant, places - view.position)
    local = away @ view.world_from_camera.matrix[:3, :3]
    row, column, ahead = _projected(local, view.lens)
    rows, columns = np.indices((height, width))
    flow = np.stack([column - columns, row - rows], axis=-1)
    known = ahead & (np.abs(flow) < _MOST).all(axis=-1)
    return np.asarray(np.where(known[..., None], flow, 0.0), np.float32), known


def _projected(local: Floats, lens: Lens) -> tuple[Floats, Floats, Bools]:
    """Return rows, columns of what each pixel's own eye sees, and whether it can, (h, w) each.

    Args:
        local: In the camera's frame, (h, w, 3) [m].
        lens: Maybe of both eyes.
    """
    height, width = local.shape[:2]
    row, column = np.empty((2, height, width))
    ahead = np.empty((height, width), dtype=np.bool_)
    for part, eye in lens.halves((width, height)):
        (row[part], column[part]), ahead[part] = eye.project(
            local[part], lens.eye_size((width, height))
        )
        row[part] += part[0].start
        column[part] += part[1].start
    return row, column, ahead


def write_flow(path: Path, flow: Image, known: Bools) -> None:
    """Write flow in the form of KITTI: 16 bits, (flow * 64 + 2^15), and 1 where it is known.

    Args:
        path: Where to.
        flow: Right and down, (h, w, 2) [px].
        known: (h, w).

    Raises:
        OSError: If the file cannot be written.
    """
    right, down = np.rint(np.moveaxis(flow.astype(np.float64), -1, 0) * _SCALE + _ZERO)
    numbers = np.stack([right, down, np.ones_like(right)], axis=-1)
    write_numbers(path, np.where(known[..., None], numbers, 0).astype(np.uint16))


def read_flow(path: Path) -> tuple[Image, Bools]:
    """Return flow, (h, w, 2) [px], to 1/128 px, and where it is known, from a file of `write_flow`.

    Raises:
        InputError: If it is missing or damaged.
    """
    right, down, valid = np.moveaxis(read_numbers(path), -1, 0)
    known = valid > 0
    flow = (np.stack([right, down], axis=-1).astype(np.float32) - _ZERO) / _SCALE
    return np.where(known[..., None], flow, np.float32(0.0)), known


_NAME = "CryptoThing"
_RANKS = 6
"""Things of a pixel that are stored, those that cover most first."""


def id_number(name: str) -> np.float32:
    """Return the floating-point number that stands for a name; never NaN or denormal."""
    bits = murmur3(name.encode())
    exponent = bits >> 23 & 255
    if exponent in (0, 255):
        bits ^= 1 << 23
    return np.uint32(bits).view(np.float32)


def mattes(owners: Sequence[Ints], names: Sequence[str]) -> dict[str, Image]:
    """Return the channels of a Cryptomatte, (h, w) each, by name.

    Args:
        owners: Number of the name at some places of every pixel, (h, w) each; 0 is nothing.
        names: By number; the first does not count.
    """
    shape, samples = owners[0].shape, np.stack([one.ravel() for one in owners], axis=-1)
    ranks = min(_RANKS, len(owners))
    which = np.zeros((len(samples), ranks), np.int64)
    share = np.zeros((len(samples), ranks), np.float32)
    # Most pixels show one thing alone.
    which[:, 0] = samples[:, 0]
    share[:, 0] = samples[:, 0] > 0
    mixed = (samples != samples[:, :1]).any(axis=1)
    which[mixed], share[mixed] = _ranked(samples[mixed], ranks)
    numbers = np.array([0.0, *(id_number(name) for name in names[1:])], np.float32)
    ids = numbers[which]
    channels: dict[str, Image] = {}
    for rank in range(ranks):
        level, pair = divmod(rank, 2)
        for channel, values in zip(("RG", "BA")[pair], (ids, share), strict=True):
            channels[f"{_NAME}{level:02d}.{channel}"] = values[:, rank].reshape(shape)
    return channels


def _ranked(samples: Ints, ranks: int) -> tuple[Ints, Image]:
    """Return what covers pixels most, and its shares, (n, ranks) each; 0 where there is no more.

    Args:
        samples: Numbers at places of pixels, (n, places); 0 is nothing.
        ranks: How many are wanted, at most as many as there are places.
    """
    samples = np.sort(samples, axis=-1)
    count = samples.shape[1]
    # A run of equal numbers is counted at its first place; other places get nothing.
    first = np.ones(samples.shape, dtype=np.bool_)
    first[:, 1:] = samples[:, 1:] != samples[:, :-1]
    run = np.cumsum(first, axis=-1) - 1 + np.arange(len(samples))[:, None] * count
    lengths = np.bincount(run.ravel(), minlength=samples.size)
    covered = np.where(first & (samples > 0), lengths[run], 0)
    order = np.argsort(-covered, axis=-1, kind="stable")[:, :ranks]
    share = np.take_along_axis(covered, order, axis=-1).astype(np.float32) / np.float32(count)
    return np.where(share > 0.0, np.take_along_axis(samples, order, axis=-1), 0), share


def header(names: Sequence[str]) -> Mapping[str, str]:
    """Return the strings of a Cryptomatte's header, with the manifest of some names."""
    key = f"cryptomatte/{murmur3(_NAME.encode()):08x}"[:19]
    manifest = {name: f"{id_number(name).view(np.uint32):08x}" for name in sorted(names)}
    return {
        f"{key}/name": _NAME,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": json.dumps(manifest),
    }


SURFACES = frozenset({"road", "sidewalk", "terrain", "ground", "rail track", "sky", "static"})
"""Classes of what has no box: it has no outline of its own, or no class."""

_KITTI: Mapping[str, str] = {
    "bicycle": "Cyclist",
    "car": "Car",
    "motorcycle": "Cyclist",
    "person": "Pedestrian",
    "train": "Tram",
    "truck": "Truck",
}
"""KITTI's words for classes; all others are `Misc`."""

_NEAR = 0.05  # corners of boxes nearer than this before the camera are cut off [m]


@dataclass(frozen=True, slots=True)
class Box2d:
    """The smallest box around all pixels of a thing.

    Attributes:
        name: Of the thing.
        left: First column.
        top: First row.
        right: After the last column.
        bottom: After the last row.
        pixels: How many pixels show it.
    """

    name: str
    left: int
    top: int
    right: int
    bottom: int
    pixels: int


@dataclass(frozen=True, slots=True, eq=False)
class Box3d:
    """A box around a body, or around a unit of a long vehicle; its foot stands on the road.

    Attributes:
        name: Of the road user.
        part: Empty, or which unit it is.
        size: Length, width, height [m].
        world_from_box: Its middle; +x forward, +y left, +z up.
    """

    name: str
    part: str
    size: tuple[float, float, float]
    world_from_box: Transform

    @property
    def corners(self) -> Floats:
        """All corners in the network's coordinates, (8, 3) [m]."""
        signs = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        return self.world_from_box.points(signs * self.size)


def boxes_2d(owner: Ints, names: Sequence[str]) -> tuple[Box2d, ...]:
    """Return the box of every name that some pixel shows, in the names' order.

    Args:
        owner: Number of the name at each pixel, (h, w); 0 has none.
        names: Of things; the first is empty.
    """
    from scipy import ndimage

    counts = np.bincount(owner.ravel(), minlength=len(names))
    boxes = []
    for number, box in enumerate(ndimage.find_objects(owner.astype(np.int32)), start=1):
        if box is not None:
            rows, columns = box
            edges = (columns.start, rows.start, columns.stop, rows.stop)
            boxes.append(Box2d(names[number], *edges, int(counts[number])))
    return tuple(boxes)


def box_3d(name: str, part: str, bounds: Floats, world_from_body: Transform) -> Box3d:
    """Return the box around a body, down to the road.

    Args:
        name: Of the road user.
        part: Which unit it is, or empty.
        bounds: Lowest and highest corner in the body's frame, (2, 3) [m].
        world_from_body: Its placement.
    """
    low, high = np.array(bounds)
    low[2] = min(low[2], 0.0)
    scale = np.linalg.norm(world_from_body.matrix[:3, :3], axis=0)
    matrix = world_from_body.matrix.copy()
    matrix[:3, :3] /= scale
    matrix[:3, 3] = world_from_body.points(0.5 * (low + high)[None])[0]
    length, width, height = ((high - low) * scale).tolist()
    return Box3d(name, part, (length, width, height), Transform(matrix))


def coco_categories() -> list[dict[str, Any]]:
    """Return all classes as COCO lists them."""
    return [{"id": number, "name": name} for name, number in LABELS.items()]


def kitti_line(box: Box3d, seen: Box2d, label: str, view: View, size: tuple[int, int]) -> str:
    """Return a line of a KITTI label file.

    KITTI's boxes turn about the camera's vertical axis alone, so those of a camera that looks up
    or down are not exact; `Box3d` is. How much is hidden is said to be unknown (3).

    Args:
        box: Around the body.
        seen: Around its pixels.
        label: Its class.
        view: Of the camera.
        size: Width, height of the picture [px].
    """
    forward = _camera_axes(box.world_from_box.matrix[:3, 0], view)
    length, width, height = box.size
    foot = box.world_from_box.points(np.array([[0.0, 0.0, -0.5 * height]]))[0]
    x, y, z = _camera_axes(foot - view.position, view)
    turn = float(-np.arctan2(forward[2], forward[0]))
    alpha = (turn - np.arctan2(x, z) + np.pi) % (2.0 * np.pi) - np.pi
    numbers = [height, width, length, x, y, z, turn]
    edges = (seen.left, seen.top, seen.right - 1, seen.bottom - 1)
    return " ".join(
        [
            _KITTI.get(label, "Misc"),
            f"{truncated(box, view, size):.2f} 3 {alpha:.4f}",
            *(f"{edge:.2f}" for edge in edges),
            *(f"{number:.4f}" for number in numbers),
        ]
    )


def kitti_calibration(focal: float, centre: tuple[float, float]) -> str:
    """Return KITTI's calibration of a single camera, with all lines in the order of its files.

    All four cameras are this one. The laser scanner and the inertial unit, which we do not have,
    sit in its eye: forward, left, up.

    Args:
        focal: Focal length [px].
        centre: Column and row of the optical axis [px].
    """
    camera = (focal, 0, centre[0], 0, 0, focal, centre[1], 0, 0, 0, 1, 0)
    lines = {
        **{f"P{k}": camera for k in range(4)},
        "R0_rect": (1, 0, 0, 0, 1, 0, 0, 0, 1),
        "Tr_velo_to_cam": (0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0),
        "Tr_imu_to_velo": (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0),
    }
    return "".join(
        f"{name}: {' '.join(f'{value:.12e}' for value in values)}\n"
        for name, values in lines.items()
    )


def truncated(box: Box3d, view: View, size: tuple[int, int]) -> float:
    """Return the share of a box's rectangle in the picture that lies outside of it, [0, 1]."""
    local = (box.corners - view.position) @ view.world_from_camera.matrix[:3, :3]
    if view.lens.is_straight:
        local[:, 0] = np.maximum(local[:, 0], _NEAR)
    places, _ = view.lens.project(local, size)
    low, high = places.min(axis=1), places.max(axis=1)
    ends = np.array([size[1], size[0]]) - 0.5
    inside = np.maximum(np.minimum(high, ends) - np.maximum(low, -0.5), 0.0)
    return float(1.0 - inside.prod() / max(float((high - low).prod()), 1e-9))


def _camera_axes(vector: Floats, view: View) -> Floats:
    """Return a world vector as KITTI's cameras have it: right, down, forward."""
    forward, left, up = view.world_from_camera.matrix[:3, :3].T @ vector
    return np.array([-left, -up, forward])
