"""Makes finished pictures of traced ones: denoised, mixed, with lamps, haze and what falls.

Noise is removed by Intel Open Image Denoise through `mitsuba-oidn`, on linear radiance: on the GPU
that traces, where the library finds it, else on the processor. The two give other last digits.

Haze is aerial perspective, laid on in linear radiance before the picture is stored. Far things fade
into the light of the horizon behind them: radiance x transmittance + horizon radiance x (1 -
transmittance). Sky and sun lie behind the haze model and are left alone. The transmittance comes
from a depth pass and its share of hit samples. As these have noise, the denoiser comes after it.

By day rain and snow in the same air have the horizon's light, too. By night lamps light them, and
then they count with the haze: of what far things fade into, haze gives its share of the extinction
alone, and what lamps give is in the picture already.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cache
from typing import Any

import mitsuba as mi
import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from sumo3dviz_pt.model.falling import Falling, SkyLight
from sumo3dviz_pt.model.geometry import Bools, Image, Ints
from sumo3dviz_pt.model.layers import LUMINANCE, Layers
from sumo3dviz_pt.model.lens import planes_of_rays
from sumo3dviz_pt.model.scene import Haze, View
from sumo3dviz_pt.render.backend import traces_by_optix
from sumo3dviz_pt.render.passes.regression import regressed
from sumo3dviz_pt.render.sky.baked import horizon_towards

log = logging.getLogger(__name__)

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
        device=_device(denoiser_device()),
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


def denoiser_device() -> str:
    """Return where pictures are denoised: `cuda` with that variant of Mitsuba, if it can be."""
    return _found_device(traces_by_optix(mi.variant() or ""))


@cache
def _found_device(wanted: bool) -> str:
    """Return `cuda` if that is wanted and works, else `cpu`; say once where it does not work."""
    import mitsuba_oidn as oidn

    if wanted:
        try:
            _device("cuda")
        except oidn.Error as error:
            log.warning("the denoiser cannot use the GPU (%s): it uses the processor", error)
        else:
            return "cuda"
    return "cpu"


@cache
def _device(name: str) -> Any:
    """Return the process's only device: each keeps half a gigabyte of buffers at 1280x720."""
    import mitsuba_oidn as oidn

    if name == "cuda":
        return oidn.Device.cuda(0)
    device = oidn.Device(oidn.DeviceType.CPU)
    device.num_threads = _THREADS
    return device


def apply_haze(radiance: Image, haze: Haze, *, depth: Image, hit: Image, behind: Image) -> Image:
    """Lay haze between the camera and what it sees.

    Args:
        radiance: (h, w, 3).
        haze: Extinction.
        depth: Mean distance of the samples, 0 where they miss, (h, w) [m].
        hit: Share of samples that hit something, (h, w) in [0, 1].
        behind: Horizon radiance in each pixel's direction, (h, w, 3).

    Returns:
        Radiance with haze, (h, w, 3).
    """
    veil = _veil(haze, depth=depth, hit=hit)
    return np.asarray(radiance + (behind - radiance) * veil, dtype=np.float32)


def _veil(haze: Haze, *, depth: Image, hit: Image) -> Image:
    """Return the share of each pixel's light that haze exchanges, (h, w, 3) in [0, 1]."""
    distance = depth / np.maximum(hit, np.float32(1e-6))
    # In a pixel that sees far things and sky, both have the horizon's light. Without this, hazy
    # hills would have a dark outline.
    sky = np.where(hit > 0, 1 - hit, np.float32(0.0))
    veil = np.empty((*hit.shape, 3), dtype=np.float32)
    for channel, extinction in enumerate(haze.extinction):
        fade = -np.expm1(distance * -(extinction + haze.falls))
        fade *= extinction / max(extinction + haze.falls, 1e-12)
        veil[..., channel] = (hit + sky * (fade * fade * fade)) * fade
    return veil


def horizon_behind(horizon: Image, view: View, size: tuple[int, int]) -> Image:
    """Return the horizon's radiance in each pixel's direction, (h, w, 3).

    Args:
        horizon: Radiance by azimuth, (columns, 3), as in `SkyMap`.
        view: Of the camera.
        size: Width, height [px].
    """
    rays = planes_of_rays(view.lens, size).reshape(3, -1)
    turn = view.world_from_camera.matrix[:3, :3].astype(np.float32)
    towards = (turn @ rays).reshape(3, size[1], size[0])
    return horizon_towards(horizon, np.moveaxis(towards, 0, -1))


@dataclass(frozen=True, slots=True, eq=False)
class Finishing:
    """How traced pictures are finished; what a film's frames share.

    Attributes:
        denoiser: `none`, `fast`, `balanced` or `high`.
        guided: Whether albedo and normals guide it.
        raw_share: Share of the raw picture that textures keep.
        haze: Aerial perspective, or None.
        horizon: Radiance by azimuth, (columns, 3), as in `SkyMap`.
        grainy_sky: Whether the open sky has noise, too: that of lamps' light in fog before it.
        falling: What falls and flies before the camera, or None.
        light: Of the sky, on what falls.
    """

    denoiser: str
    guided: bool
    raw_share: float
    haze: Haze | None
    horizon: Image
    grainy_sky: bool = False
    falling: Falling | None = None
    light: SkyLight | None = None


def finished(seen: Layers, view: View, how: Finishing) -> Image:
    """Lay haze over a picture and denoise it, then add lamps, and what falls and flies.

    Depth has noise, too: through gaps in a near crown single samples see far hills, and their haze
    would be specks if it were laid on after the denoiser.

    Args:
        seen: `radiance`, without the light of lamps that are seen directly if that is there as
            `excess`; `hit`, and what guides and haze need.
        view: Of the camera.
        how: What is to be done.

    Returns:
        Radiance, (h, w, 3).
    """
    veiled = seen | {"radiance": _hazed(seen, view, how)}
    radiance = veiled["radiance"] if how.denoiser == "none" else _denoised(veiled, how)
    if "excess" in seen:
        # Lamps are so bright that the denoiser would smear them.
        radiance = radiance + _dimmed(seen, how)
    return _with_weather(seen | {"radiance": radiance}, view, how)


def _denoised(seen: Layers, how: Finishing) -> Image:
    """Return the radiance of a picture without noise; only the part that has any is touched."""
    radiance = seen["radiance"]
    hit = np.ones_like(seen["hit"]) if how.grainy_sky else seen["hit"]
    box = noisy_box(hit)
    # Layers may be here because they are wanted, not as guides.
    known = seen if how.guided else Layers()
    guides = {name: known[name][box] for name in ("albedo", "normal") if name in known}
    raw = radiance[box]
    if not raw.size:
        return radiance
    smooth = denoise(raw, quality=how.denoiser, **guides)
    if how.denoiser == "high" and len(guides) == 2:
        smooth = regressed(smooth, raw, hit=hit[box], **guides)
    picture = radiance.copy()
    picture[box] = mixed(smooth, raw, hit=hit[box], share=how.raw_share)
    return picture


def hazed(seen: Layers, view: View, how: Finishing) -> Image:
    """Return the radiance of a picture with haze and with what falls, if there is any.

    Args:
        seen: `radiance`; `depth` and `hit` where there is haze, or anything falls.
        view: Of the camera.
        how: What is to be done.
    """
    return _with_weather(seen | {"radiance": _hazed(seen, view, how)}, view, how)


def _with_weather(seen: Layers, view: View, how: Finishing) -> Image:
    """Return the radiance of a picture that has its haze with what falls before it."""
    radiance = seen["radiance"]
    if how.falling is not None and how.light is not None:
        # Without weather nothing of it is loaded.
        from sumo3dviz_pt.render.falling.drawn import with_falling

        radiance = with_falling(radiance, seen, view, how.falling, how.light)
    if "reflected" not in seen:
        return radiance
    return np.asarray(radiance * seen["passed"][..., None] + seen["reflected"])


def _dimmed(seen: Layers, how: Finishing) -> Image:
    """Return what haze lets through of lamps that are seen directly, (h, w, 3)."""
    if how.haze is None:
        return seen["excess"]
    return np.asarray(seen["excess"] * (1 - _veil(how.haze, depth=seen["depth"], hit=seen["hit"])))


def _hazed(seen: Layers, view: View, how: Finishing) -> Image:
    """Return the radiance of a picture with haze, if there is any."""
    if how.haze is None:
        return seen["radiance"]
    behind = horizon_behind(how.horizon, view, seen.size)
    return apply_haze(
        seen["radiance"], how.haze, depth=seen["depth"], hit=seen["hit"], behind=behind
    )
