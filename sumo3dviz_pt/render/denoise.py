"""Intel Open Image Denoise through `mitsuba-oidn`, on linear radiance."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Image


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
    device = _device()
    clean = albedo is not None and normal is not None
    if albedo is not None and normal is not None:
        albedo = _prefiltered(oidn, device, "albedo", np.clip(albedo, 0.0, 1.0))
        normal = _prefiltered(oidn, device, "normal", normal)
    result = oidn.denoise(
        np.ascontiguousarray(radiance, np.float32),
        albedo,
        normal,
        hdr=True,
        clean_aux=clean,
        quality=levels[quality],
        device=device,
    )
    return np.maximum(np.array(result, dtype=np.float32), 0.0)


@cache
def _device() -> Any:
    """The process's device; each one keeps its buffers, half a gigabyte at 1280x720, for ever."""
    import mitsuba_oidn as oidn

    return oidn.Device(oidn.DeviceType.CPU)


def _prefiltered(oidn: Any, device: Any, name: str, guide: Image) -> Image:
    """A guide without its own noise, as `clean_aux` asks for."""
    source = np.ascontiguousarray(guide, np.float32)
    result = np.empty_like(source)
    kernel = device.new_filter("RT")
    kernel.set_image(name, source)
    kernel.set_image("output", result)
    kernel.quality = oidn.Quality.High
    kernel.execute()
    return result
