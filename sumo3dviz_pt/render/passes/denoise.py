"""Intel Open Image Denoise through `mitsuba-oidn`, on linear radiance."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from sumo3dviz_pt.model.colour import LUMINANCE
from sumo3dviz_pt.model.geometry import Bools, Image, Ints

_LUMINANCE = LUMINANCE.astype(np.float32)
_WINDOW = 5
"""Side of the window that tells texture from noise [px]."""

_THREADS = 4
"""Of the denoiser: it adds in another order with another number (measured: 1, 2, 3, 5 and 16 gave
four pictures), and pictures hang on no machine's or user's number of threads. Two cores take the
same time with two."""

_BLOCK = 16
"""The denoiser's network halves pictures four times [px]."""


def denoise(
    radiance: Image,
    *,
    quality: str,
    albedo: Image | None = None,
    normal: Image | None = None,
) -> Image:
    """Remove noise from a sanitised, capped picture.

    Args:
        radiance: (h, w, 3), finite and non-negative; box-filtered pixels only.
        quality: `fast`, `balanced` or `high`.
        albedo: Reflectance guide, (h, w, 3), or None.
        normal: Shading normal guide, (h, w, 3), or None; needs an albedo.

    Returns:
        The picture, (h, w, 3), non-negative.
    """
    import mitsuba_oidn as oidn

    levels = {
        "fast": oidn.Quality.Fast,
        "balanced": oidn.Quality.Balanced,
        "high": oidn.Quality.High,
    }
    # Guides go in as they are: filtering them first costs four times the denoising and
    # gains less than the same time in samples (docs/internals/samples_to_picture.md).
    result = oidn.denoise(
        np.ascontiguousarray(radiance, np.float32),
        None if albedo is None else np.ascontiguousarray(np.clip(albedo, 0.0, 1.0), np.float32),
        None if normal is None else np.ascontiguousarray(normal, np.float32),
        hdr=True,
        quality=levels[quality],
        device=_device(),
    )
    return np.maximum(np.array(result, dtype=np.float32), 0.0)


def mixed(smooth: Image, raw: Image, *, hit: Image, share: float) -> Image:
    """Give some of the raw picture back: noise of one and blur of the other partly cancel.

    Only textures get it, because there blur is seen and noise is not. A raw pixel brighter than
    twice the smooth one would flash in a film, so it is cut to that. The open sky has no noise
    and stays raw.

    Args:
        smooth: The denoised picture, (h, w, 3).
        raw: The picture before, (h, w, 3).
        hit: Share of samples that hit something, (h, w) in [0, 1].
        share: Of the raw picture where nothing but texture is seen, in [0, 1].

    Returns:
        The mixture, (h, w, 3).
    """
    held = np.minimum(raw, 2 * smooth)
    if share > 0:
        own = np.float32(share) * texture(smooth, held)[..., None]
        smooth = (smooth + own * (held - smooth)).astype(np.float32, copy=False)
    return np.where(open_sky(hit)[..., None], raw, smooth)


def noisy_box(hit: Image) -> tuple[slice, slice]:
    """Return the rows and columns outside of which nothing but the sky is seen.

    Between frames of a moving camera the box grows and shrinks by whole blocks of the denoiser's
    network, or all that it finds would change a little.

    Args:
        hit: Share of samples that hit something, (h, w) in [0, 1].
    """
    noisy = ~open_sky(hit)
    rows, columns = np.flatnonzero(noisy.any(axis=1)), np.flatnonzero(noisy.any(axis=0))
    return _reach(rows, noisy.shape[0]), _reach(columns, noisy.shape[1])


def _reach(lines: Ints, count: int) -> slice:
    """Return the rows or columns of whole blocks that hold some lines, with a block at each side.

    Args:
        lines: Numbers of rows or columns, ascending.
        count: How many rows or columns the picture has.
    """
    if not len(lines):
        return slice(0, 0)
    first, after = int(lines[0]) // _BLOCK - 1, int(lines[-1]) // _BLOCK + 2
    return slice(max(first, 0) * _BLOCK, min(after * _BLOCK, count))


def open_sky(hit: Image) -> Bools:
    """Return the pixels of squares of 3 x 3 in which nothing but the sky is seen, (h, w).

    Gaps in a tree do not count: which of them are found empty by a few samples differs from
    frame to frame, and raw pixels among smooth ones would sparkle.
    """
    inner = maximum_filter(hit, 3, mode="nearest") <= 0
    return np.asarray(maximum_filter(inner, 3, mode="constant"))


def texture(smooth: Image, raw: Image) -> Image:
    """Return how much of what varies nearby is texture rather than noise, (h, w) in [0, 1].

    This is the local variance of the denoised luminance over the sum of that variance and the
    power of what the denoiser took, as in Wiener's filter (Lee 1980,
    doi:10.1109/TPAMI.1980.4766994).
    """
    light, taken = smooth @ _LUMINANCE, (raw - smooth) @ _LUMINANCE
    mean = uniform_filter(light, _WINDOW)
    contrast = np.maximum(uniform_filter(light * light, _WINDOW) - mean * mean, 0.0)
    noise = uniform_filter(taken * taken, _WINDOW)
    return np.asarray(contrast / (contrast + noise + 1e-12), dtype=np.float32)


@cache
def _device() -> Any:
    """Return the process's only device: each keeps half a gigabyte of buffers at 1280x720."""
    import mitsuba_oidn as oidn

    device = oidn.Device(oidn.DeviceType.CPU)
    device.num_threads = _THREADS
    return device
