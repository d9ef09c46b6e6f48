"""What a real camera does to a picture, beside its tone curve: veil, softness, noise, sharpening.

A traced picture is cleaner than any that a camera took. A `Response` puts back, step by step and in
the order of a camera, what lens, sensor and recorder do:

1. The lens scatters a little light over the whole picture, draws a point as a small disc and gives
   the corners less light.
2. The sensor counts light, so noise has a part whose variance is in proportion to the signal and a
   part that is always there. By night a camera cannot expose longer: it amplifies, and noise too.
3. After the tone curve a cheap camera sharpens brightness, which leaves halos along edges, and a
   recorder keeps colour at half the resolution.

Noise is a function of a frame's own seed and the place in the picture alone: not of threads, of
machines, or of what else is rendered. It never makes light negative, because it is cut where it is
larger than the light itself, on both sides alike, so that the mean stays. Lengths are those of a
picture 1280 wide and scale with it; a smaller picture is one whose pixels were put together, so
that each has counted more light.

References:
    EMVA 1288, release 4.0, 2021, section 2 (variance of a sensor: read noise, and shot noise in
        proportion to the signal).
    ISO 18844:2017 (veiling glare as a share of the mean light).
    Rec. ITU-R BT.709-6, 2015 (luma and colour differences); ISO/IEC 14496-10 (4:2:0).
    Kingslake, "Optical System Design", 1983, section 6 (cos^4).
    The shares themselves were chosen by eye.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.ndimage import gaussian_filter1d

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.numbers import ResponseName
from sumo3dviz_pt.model.random import dice_of

_WIDE = 1280.0
"""Width of the picture that lengths and counts are meant for [px]."""

_BRIGHTEST = 2000.0
"""Limit of the light that makes a veil [x white], as of what glares."""

_STEADY = 5.0
"""Exposure up to which a camera opens its shutter for longer, and amplifies nothing [EV]."""

_GAIN = 3.0
"""The most that it amplifies [EV]; beyond that a camera takes noise away again."""

_LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Share of red, green and blue in luma, BT.709."""


@dataclass(frozen=True, slots=True)
class Response:
    """What a camera does to a picture.

    Attributes:
        veil: Share of all light that is spread evenly over the picture, [0, 1].
        softness: Standard deviation of a point's picture [px of 1280].
        fall: Share of light that is missing in the corners, [0, 1).
        electrons: That a pixel has counted at white, without gain, 1280 wide.
        read: Noise of reading a pixel, standard deviation [electrons], 1280 wide.
        sharpening: How much of what is finer than `halo` is added to luma.
        halo: Standard deviation of the picture that sharpening takes away [px of 1280].
        halves_colour: Whether colour has half the resolution.
        seed: Of noise: the frame's own.
    """

    veil: float
    softness: float
    fall: float
    electrons: float
    read: float
    sharpening: float = 0.0
    halo: float = 1.0
    halves_colour: bool = False
    seed: int = 0

    def on_light(self, exposed: Image, *, exposure: float) -> Image:
        """Return light as a sensor has counted it behind a lens.

        Args:
            exposed: Linear light, 1 is white, (h, w, 3), finite and not negative.
            exposure: At which it is developed [EV]; says how much is amplified.

        Returns:
            The same, not negative.
        """
        light = self._softened(self._veiled(exposed)) * self._fall(*exposed.shape[:2])[..., None]
        return self._noisy(light, exposure)

    def on_picture(self, encoded: Image) -> Image:
        """Return a picture as a recorder keeps it.

        Args:
            encoded: sRGB code values, (h, w, 3) in [0, 1].

        Returns:
            The same.
        """
        picture = encoded
        if self.sharpening:
            luma = picture @ _LUMA
            rough = _blurred(luma, self.halo * picture.shape[1] / _WIDE)
            picture = picture + np.float32(self.sharpening) * (luma - rough)[..., None]
        if self.halves_colour:
            picture = _with_half_colour(np.clip(picture, 0.0, 1.0))
        return np.asarray(np.clip(picture, 0.0, 1.0), np.float32)

    def deviation(self, light: Image, *, exposure: float, width: int) -> Image:
        """Return the standard deviation of noise, in the light's own unit.

        Args:
            light: Linear light, 1 is white, of any shape.
            exposure: At which it is developed [EV].
            width: Of the picture [px].
        """
        gain = 2.0 ** min(max(exposure - _STEADY, 0.0), _GAIN)
        together = (_WIDE / width) ** 2
        white = self.electrons * together / gain
        variance = light / np.float32(white) + np.float32(self.read**2 * together / white**2)
        return np.asarray(np.sqrt(variance), np.float32)

    def _veiled(self, light: Image) -> Image:
        """Return light of which a share is spread evenly; its sum stays."""
        bright = np.minimum(light, np.float32(_BRIGHTEST))
        mean = bright.mean(axis=(0, 1), dtype=np.float64).astype(np.float32)
        return np.asarray(light + np.float32(self.veil) * (mean - bright), np.float32)

    def _softened(self, light: Image) -> Image:
        """Return light of which every point is a small disc; its sum stays."""
        return _blurred(light, self.softness * light.shape[1] / _WIDE)

    def _fall(self, height: int, width: int) -> Image:
        """Return by what the light of each pixel is multiplied, (h, w): cos^4, 1 in the middle."""
        x = (np.arange(width) + 0.5) / width * 2.0 - 1.0
        y = (np.arange(height) + 0.5) / height * 2.0 - 1.0
        # The square of the tangent, where that of the corner is as steep as the fall demands.
        corner = 1.0 / np.sqrt(1.0 - self.fall) - 1.0
        square = (x[None] ** 2 * width**2 + y[:, None] ** 2 * height**2) / (width**2 + height**2)
        return np.asarray(1.0 / np.square(1.0 + corner * square), np.float32)

    def _noisy(self, light: Image, exposure: float) -> Image:
        """Return light with noise, each channel with its own."""
        noise = dice_of(self.seed, "response").standard_normal(light.shape, np.float32)
        noise *= self.deviation(light, exposure=exposure, width=light.shape[1])
        return np.asarray(light + np.clip(noise, -light, light), np.float32)


_RESPONSES: Mapping[ResponseName, Response | None] = MappingProxyType(
    {
        "none": None,
        "dashcam": Response(
            veil=0.02,
            softness=0.55,
            fall=0.25,
            electrons=7000.0,
            read=5.0,
            sharpening=0.5,
            halo=1.2,
            halves_colour=True,
        ),
        "cinema": Response(veil=0.005, softness=0.35, fall=0.1, electrons=30000.0, read=4.0),
    }
)
"""What cameras do to pictures, by the name that users choose."""


def response_names() -> tuple[str, ...]:
    """Return the names of all responses; the first is the default, and does nothing."""
    return tuple(_RESPONSES)


def response_named(name: str) -> Response | None:
    """Look a response up; None does nothing.

    Raises:
        ConfigError: If there is none of that name; the message suggests one.
    """
    for known, response in _RESPONSES.items():
        if name == known:
            return response
    hint = did_you_mean(name, response_names())
    raise ConfigError(f"no camera's response is called {name!r}{hint}", key="output.response")


def _blurred(image: Image, sigma: float) -> Image:
    """Return a picture blurred by a Gaussian [px]; mirrored at its edges, so that its sum stays."""
    for axis in (0, 1):
        image = gaussian_filter1d(image, sigma, axis=axis, mode="reflect", truncate=4.0)
    return np.asarray(image, np.float32)


def _with_half_colour(picture: Image) -> Image:
    """Return a picture, (h, w, 3), whose colour has half the resolution across and down.

    Its luma stays; colours are means of squares of four pixels, and linear between their middles.
    """
    luma = picture @ _LUMA
    # Blue and red less luma carry all colour; green follows, as luma is what it was.
    halved = [_between(_squares(picture[..., channel] - luma), luma.shape) for channel in (0, 2)]
    red, blue = (each + luma for each in halved)
    green = (luma - _LUMA[0] * red - _LUMA[2] * blue) / _LUMA[1]
    return np.stack([red, green, blue], axis=-1)


def _squares(plane: Image) -> Image:
    """Return the means of squares of four pixels; an odd last row or column is doubled."""
    height, width = plane.shape
    whole = np.pad(plane, ((0, height % 2), (0, width % 2)), mode="edge")
    return np.asarray(whole.reshape(-(-height // 2), 2, -(-width // 2), 2).mean(axis=(1, 3)))


def _between(coarse: Image, shape: tuple[int, ...]) -> Image:
    """Return a plane of (h, w) pixels, linear between the middles of squares of four."""
    for axis, length in enumerate(shape):
        padded = np.pad(coarse, [(1, 1) if each == axis else (0, 0) for each in (0, 1)], "edge")
        before, own, after = (
            np.take(padded, np.arange(first, first + coarse.shape[axis]), axis=axis)
            for first in (0, 1, 2)
        )
        pairs = np.stack([0.75 * own + 0.25 * before, 0.75 * own + 0.25 * after], axis=axis + 1)
        coarse = pairs.reshape([-1 if each == axis else n for each, n in enumerate(own.shape)])
        coarse = np.take(coarse, np.arange(length), axis=axis)
    return np.asarray(coarse, np.float32)
