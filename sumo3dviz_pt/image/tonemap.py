"""Develops radiance into pixels: exposure, tone curve, sRGB encoding.

Tone curves are registered in `TONES`; each maps linear radiance (1.0 is white at
the chosen exposure) to linear display light in [0, 1]. For studies, `srgb` keeps colours as
they are up to white, `camera` up to 0.3 of it, and `neutral` but for a toe; all three can be
inverted.

References:
    Khronos PBR Neutral tone mapper specification, 2024 (neutral).
    IEC 61966-2-1:1999 (sRGB).
    T. Sobotka, AgX, 2022; polynomial by B. Wrensch, "Minimal AgX", 2023 (agx).
    S. Hill, fit of the ACES 1.0 reference rendering and sRGB output transforms,
    BakingLab, 2016 (filmic).
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.image.optics import bloom
from sumo3dviz_pt.image.response import Response
from sumo3dviz_pt.model.geometry import Image

Curve = Callable[[Image], Image]
"""Turns linear radiance, (..., 3), finite and >= 0, into display light in [0, 1]."""

_BRIGHTEST = np.float32(1e6)
"""Radiance is clipped here, so that squares stay finite in single precision."""


def _matrix(*rows: tuple[float, float, float]) -> NDArray[np.float32]:
    """Return a matrix that is applied to row vectors from the right."""
    return np.array(rows, dtype=np.float32).T


def srgb(linear: Image) -> Image:
    """Apply no curve; clip at white."""
    return np.asarray(np.clip(linear, 0.0, 1.0))


_TRUE, _CLIPS, _KNEE = 0.3, 1.0, 0.35
"""Up to where `camera` changes nothing, where it reaches white, and its slope there."""


def camera(linear: Image) -> Image:
    """Apply a camera's curve: true colours and shadows, a little contrast, sunlit cloud clips.

    There is no toe: what is dark keeps its colour, as in a photograph. The brightest channel
    follows a cubic from 0.3 to white, the others keep their ratio to it; what is brighter
    than white fades to it.
    """
    peak = np.maximum(linear.max(axis=-1, keepdims=True), 1e-9)
    span = _CLIPS - _TRUE
    t = np.clip((peak - _TRUE) / span, 0.0, 1.0)
    # Hermite's cubic: slope 1 where it begins.
    rest = 1.0 - t
    high = (_TRUE * (1.0 + 2.0 * t) + span * t) * rest * rest
    high += (3.0 - 2.0 * t - span * _KNEE * rest) * t * t
    new_peak = np.where(peak < _TRUE, peak, high)
    return _faded(linear * (new_peak / peak), peak, new_peak)


_DESATURATION = 0.15
"""How soon what is brighter than white fades to it, as Khronos PBR Neutral has it."""


def _faded(colour: Image, peak: Image, new_peak: Image) -> Image:
    """Colours whose brightest channel was brought down, which lets them fade to white."""
    down = np.maximum(peak - new_peak, 0.0)
    white = 1.0 - 1.0 / (_DESATURATION * down + 1.0)
    light = np.clip(colour + (new_peak - colour) * white, 0.0, 1.0)
    return np.asarray(light, dtype=np.float32)


def neutral(linear: Image) -> Image:
    """Apply Khronos PBR Neutral: true colours up to 0.76, then a soft, desaturating shoulder."""
    start = 0.8 - 0.04
    darkest = linear.min(axis=-1, keepdims=True)
    offset = np.where(darkest < 0.08, darkest - 6.25 * darkest * darkest, 0.04)
    colour = linear - offset
    peak = np.maximum(colour.max(axis=-1, keepdims=True), 1e-9)
    room = 1.0 - start
    above = np.maximum(peak, start)
    new_peak = np.where(peak < start, peak, 1.0 - room * room / (above + room - start))
    return _faded(colour * (new_peak / peak), peak, new_peak)


_REC2020_FROM_SRGB = _matrix(
    (0.6274, 0.3293, 0.0433), (0.0691, 0.9195, 0.0113), (0.0164, 0.0880, 0.8956)
)
_SRGB_FROM_REC2020 = _matrix(
    (1.6605, -0.5876, -0.0728), (-0.1246, 1.1329, -0.0083), (-0.0182, -0.1006, 1.1187)
)
_AGX_INSET = _matrix(
    (0.856627153315983, 0.0951212405381588, 0.0482516061458583),
    (0.137318972929847, 0.761241990602591, 0.101439036467562),
    (0.11189821299995, 0.0767994186031903, 0.811302368396859),
)
_AGX_OUTSET = _matrix(
    (1.1271005818144368, -0.11060664309660323, -0.016493938717834573),
    (-0.1413297634984383, 1.157823702216272, -0.016493938717834257),
    (-0.14132976349843826, -0.11060664309660294, 1.2519364065950405),
)
_AGX_CONTRAST = (15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232)
_AGX_EV = (-12.47393, 4.026069)


def agx(linear: Image) -> Image:
    """Apply AgX's base look: 16.5 EV of range, bright colours fade to white.

    The published polynomial is rescaled so that black is 0 and white is 1.
    """
    inset = np.maximum(linear @ _REC2020_FROM_SRGB @ _AGX_INSET, 1e-10)
    low, high = _AGX_EV
    stops = np.clip((np.log2(inset) - low) / (high - low), 0.0, 1.0)
    black, white = _AGX_CONTRAST[-1], sum(_AGX_CONTRAST)
    shaped = (np.polyval(_AGX_CONTRAST, stops) - black) / (white - black)
    light = np.maximum(shaped @ _AGX_OUTSET, 0.0) ** 2.2
    return np.clip(light @ _SRGB_FROM_REC2020, 0.0, 1.0).astype(np.float32, copy=False)


_ACES_IN = _matrix(
    (0.59719, 0.35458, 0.04823), (0.07600, 0.90834, 0.01566), (0.0284, 0.13383, 0.83777)
)
_ACES_OUT = _matrix(
    (1.60475, -0.53108, -0.07367), (-0.10208, 1.10813, -0.00605), (-0.00327, -0.07276, 1.07602)
)
_ACES_SCALE = 1.4607
"""Chosen so that middle grey, 0.18, stays 0.18; the fit alone darkens by half a stop."""


def filmic(linear: Image) -> Image:
    """Apply Hill's fit of ACES: strong contrast, dark shadows, bright colours fade to white."""
    colour = (_ACES_SCALE * linear) @ _ACES_IN
    above = colour * (colour + 0.0245786) - 0.000090537
    below = colour * (0.983729 * colour + 0.4329510) + 0.238081
    return np.clip((above / below) @ _ACES_OUT, 0.0, 1.0).astype(np.float32, copy=False)


TONES: Mapping[str, Curve] = MappingProxyType(
    {"camera": camera, "neutral": neutral, "srgb": srgb, "agx": agx, "filmic": filmic}
)
"""Tone curves by the name that users choose."""


def tone_names() -> tuple[str, ...]:
    """Return the names of all tone curves; the first is the default."""
    return tuple(TONES)


def tone_curve(name: str) -> Curve:
    """Look a tone curve up.

    Raises:
        ConfigError: If there is none of that name; the message suggests one.
    """
    if name in TONES:
        return TONES[name]
    near = difflib.get_close_matches(name, TONES, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(TONES)}"
    raise ConfigError(f"no tone curve is called {name!r}; {hint}", key="output.tone")


def srgb_encoded(linear: NDArray[Any]) -> Image:
    """Encode display light in [0, 1], of any shape, as sRGB code values in [0, 1]."""
    linear = np.asarray(linear, dtype=np.float32)
    high = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, high).astype(np.float32, copy=False)


def develop_float(
    radiance: Image,
    *,
    exposure: float = 0.0,
    tone: str = "camera",
    glare: float = 0.0,
    response: Response | None = None,
) -> Image:
    """Develop radiance without rounding.

    Args:
        radiance: Linear sRGB primaries, (h, w, 3); negative values count as 0.
        exposure: Factor 2^exposure before the curve [EV].
        tone: A name from `tone_names`.
        glare: Share of the light that the lens spreads, in [0, 1].
        response: What a camera adds; None adds nothing.

    Returns:
        sRGB-encoded picture, (h, w, 3) in [0, 1].

    Raises:
        ConfigError: If the tone curve is unknown.
        RenderError: If a value is not finite; sanitising is the renderer's work.
    """
    curve = tone_curve(tone)
    broken = radiance.size - int(np.count_nonzero(np.isfinite(radiance)))
    if broken:
        raise RenderError(f"{broken} of {radiance.size} radiance values are not finite")
    exposed = np.asarray(radiance, dtype=np.float32) * np.float32(2.0**exposure)
    light = bloom(np.clip(exposed, 0.0, _BRIGHTEST), glare)
    if response is not None:
        light = response.on_light(light, exposure=exposure)
    # Curves take a third of the time if each channel lies for itself in memory.
    light = np.moveaxis(np.ascontiguousarray(np.moveaxis(light, -1, 0)), 0, -1)
    picture = np.clip(srgb_encoded(curve(light)), 0.0, 1.0)
    return picture if response is None else response.on_picture(picture)


def develop(
    radiance: Image,
    *,
    exposure: float = 0.0,
    tone: str = "camera",
    glare: float = 0.0,
    response: Response | None = None,
    dither: int | None = None,
) -> NDArray[np.uint8]:
    """Develop radiance into 8-bit sRGB pixels, (h, w, 3).

    Args:
        radiance: As in `develop_float`.
        exposure: As in `develop_float` [EV].
        tone: As in `develop_float`.
        glare: As in `develop_float`.
        response: As in `develop_float`.
        dither: Seed of triangular noise of +-1 code, which hides banding in skies;
            None rounds.

    Raises:
        ConfigError: If the tone curve is unknown.
        RenderError: If a value is not finite.
    """
    codes = 255.0 * develop_float(
        radiance, exposure=exposure, tone=tone, glare=glare, response=response
    )
    if dither is not None:
        rng = np.random.default_rng(dither)
        codes += rng.random(codes.shape, np.float32) - rng.random(codes.shape, np.float32)
    return np.clip(np.round(codes), 0, 255).astype(np.uint8)
