"""Optical flow: where everything that a frame's pixels show is in the next frame's picture.

References:
    Menze and Geiger, "Object Scene Flow for Autonomous Vehicles", CVPR 2015,
        doi:10.1109/CVPR.2015.7298925; the form of files as in the KITTI development kit
        (https://www.cvlibs.net/datasets/kitti/eval_scene_flow.php).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sumo3dviz_pt.image.layers.numbers import read_numbers, write_numbers
from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View

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
