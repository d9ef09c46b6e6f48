"""What lens and film do to light that has come in: glare, falling off to corners, grain.

All act on radiance when it is developed, so that stored frames stay what was traced.

Glare makes lamps look bright in a picture. A share of all light is spread over three discs of
growing size. Together they fall off roughly with the cube of the distance, like light that a lens
scatters. Light is neither added nor lost, except what leaves the picture.

References:
    G. Spencer, P. Shirley, K. Zimmerman, D. Greenberg, Physically-based glare effects for
    digital images, SIGGRAPH 1995 (scattered light falls with the angle to the power of 2 to 3).
    Natural vignetting is cos^4 of the angle from the axis (Kingslake, "Optical System Design",
        1983, section 6).
    Newson, Delon and Galerne, "A stochastic film grain model for resolution-independent
        rendering", Computer Graphics Forum 36, 2017, doi:10.1111/cgf.13159: of grains that cover a
        share u of the film, the variance is in proportion to u (1 - u).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.lens import Lens

_DISCS = ((1.0 / 180.0, 0.55), (1.0 / 60.0, 0.3), (1.0 / 20.0, 0.15))
"""Standard deviation, in picture heights, and share of what is spread; chosen by eye."""

_BRIGHTEST = 2000.0
"""Limit of the light that glares [x white], because brighter lights are often tiny."""

_COARSE = 3.0
"""Wider discs are computed at a lower resolution [px]."""


def bloom(exposed: Image, share: float) -> Image:
    """Spread a share of the light.

    Args:
        exposed: Linear light, 1 is white, (h, w, 3).
        share: Of all light, in [0, 1]; 0 changes nothing.
    """
    if share <= 0.0:
        return exposed
    bright = np.minimum(exposed, np.float32(_BRIGHTEST))
    spread = np.zeros_like(bright)
    for size, part in _DISCS:
        spread += np.float32(part) * _blurred(bright, size * exposed.shape[0])
    return np.asarray(exposed + np.float32(share) * (spread - bright), dtype=np.float32)


def _blurred(image: Image, sigma: float) -> Image:
    """Return a picture blurred by a Gaussian [px]; edges fade into what is just inside."""
    step = max(int(sigma / _COARSE), 1)
    coarse = _shrunk(image, step) if step > 1 else image
    for axis in (0, 1):
        coarse = gaussian_filter1d(coarse, sigma / step, axis=axis, mode="nearest", truncate=3.5)
    if step == 1:
        return np.asarray(coarse, dtype=np.float32)
    height, width = image.shape[:2]
    return _stretched(_stretched(coarse, step, width, axis=1), step, height, axis=0)


def _stretched(coarse: Image, step: int, length: int, *, axis: int) -> Image:
    """Return a picture of so many pixels along an axis, linear between the means of blocks."""
    place = np.clip((np.arange(length) + 0.5) / step - 0.5, 0.0, coarse.shape[axis] - 1)
    before = place.astype(np.intp)
    after = np.minimum(before + 1, coarse.shape[axis] - 1)
    share = np.expand_dims((place - before).astype(np.float32), (1 - axis, 2))
    left, right = (np.take(coarse, which, axis=axis) for which in (before, after))
    right -= left
    right *= share
    left += right
    return np.asarray(left, dtype=np.float32)


def _shrunk(image: Image, step: int) -> Image:
    """Return the means of square blocks; the last blocks repeat the edge."""
    height, width = image.shape[:2]
    pad = ((0, -height % step), (0, -width % step), (0, 0))
    whole = np.pad(image, pad, mode="edge")
    rows, columns = whole.shape[0] // step, whole.shape[1] // step
    return np.asarray(whole.reshape(rows, step, columns, step, 3).mean(axis=(1, 3)))


_COARSEST = 0.12
"""Deviation of the coarsest grain in mid-grey [share of white]."""

_GRAIN = 1.0 / 900.0
"""Size of grains [picture heights]."""


@dataclass(frozen=True, slots=True)
class Optics:
    """What happens to light in a camera.

    Attributes:
        vignetting: Share of the natural fall of light to the corners, [0, 1].
        grain: Of film, [0, 1].
        slope: Of rays through the middle of the picture's left edge.
        eyes: Columns and rows of eyes' pictures in one.
    """

    vignetting: float = 0.0
    grain: float = 0.0
    slope: float = 1.0
    eyes: tuple[int, int] = (1, 1)

    @classmethod
    def of(cls, lens: Lens, *, vignetting: float, grain: float) -> Optics | None:
        """Return what a lens does to light; None where it does nothing."""
        if not vignetting and not grain:
            return None
        eyes = {"side_by_side": (2, 1), "top_bottom": (1, 2)}.get(lens.stereo, (1, 1))
        return cls(vignetting, grain, round(lens.edges(1.0)[0], 9), eyes)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any] | None) -> Optics | None:
        """Return what an account says; None where it says nothing."""
        if content is None:
            return None
        columns, rows = content["eyes"]
        vignetting, grain = float(content["vignetting"]), float(content["grain"])
        return cls(vignetting, grain, float(content["slope"]), (int(columns), int(rows)))

    def on(self, radiance: Image, *, exposure: float, seed: int) -> Image:
        """Return radiance with all that happens to it.

        Args:
            radiance: Scene units, (h, w, 3).
            exposure: At which it is developed [EV].
            seed: Of the grain: the frame's own.
        """
        image = np.asarray(radiance, np.float32)
        if self.vignetting:
            image = image * self._fall(image.shape[1], image.shape[0])[..., None]
        if self.grain:
            image = grained(image * np.float32(2.0**exposure), self.grain, seed)
            image = image * np.float32(2.0**-exposure)
        return image

    def _fall(self, width: int, height: int) -> Image:
        """Return by what the light of each pixel is multiplied, (h, w)."""
        columns, rows = self.eyes
        eye_width, eye_height = width // columns, height // rows
        x = (np.arange(eye_width) + 0.5) / eye_width * 2.0 - 1.0
        y = ((np.arange(eye_height) + 0.5) * 2.0 - eye_height) / eye_width
        square = self.slope**2 * (x[None] ** 2 + y[:, None] ** 2)
        fall = 1.0 - self.vignetting * (1.0 - 1.0 / np.square(1.0 + square))
        whole = np.ones((height, width), np.float32)
        tiled = np.tile(fall, (rows, columns))
        whole[: tiled.shape[0], : tiled.shape[1]] = tiled
        return whole


def grained(exposed: Image, amount: float, seed: int) -> Image:
    """Return a picture with film's grain, the same for all channels.

    Its mean stays, and black and white have none.

    Args:
        exposed: Linear light, 1 is white, (h, w, 3).
        amount: 0 to 1.
        seed: Of chance.
    """
    height, width = exposed.shape[:2]
    noise = np.random.default_rng(seed).standard_normal((height, width), np.float32)
    size = _GRAIN * height
    if size > 0.5:
        noise = gaussian_filter(noise, 0.5 * size)
        noise /= max(float(noise.std()), 1e-6)
    share = np.clip(exposed.mean(axis=-1), 0.0, 1.0)
    spread = 2.0 * np.sqrt(share * (1.0 - share)) * np.float32(amount * _COARSEST)
    return np.asarray(np.maximum(exposed * (1.0 + spread * noise)[..., None], 0.0), np.float32)
