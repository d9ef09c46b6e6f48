"""Exposure as photographers set it: by the sky, metered once per shot, by hand, or fixed.

Metering takes small pictures of a few frames, evenly over the shot. It is a function of the scene
file and the shot alone, so a still, a part of a film and a whole film are exposed alike; then it is
locked. What matters is what is lit: surfaces, and the sky only where hardly anything else is seen.
The cabin of the vehicle that a camera rides in does not matter. Nothing but a few pixels may get
brighter than white.

References:
    Reinhard, Stark, Shirley and Ferwerda, "Photographic tone reproduction for digital images",
        SIGGRAPH 2002, doi:10.1145/566654.566575: the log-average is brought to a key.
    Krawczyk, Myszkowski and Seidel, "Lightness perception in tone reproduction for high dynamic
        range images", Computer Graphics Forum 24, 2005, doi:10.1111/j.1467-8659.2005.00888.x: the
        key falls with the luminance, so that night stays night.
    ISO 12232:2019, saturation-based speed: white is 78 / (0.65 S) N^2 / t cd/m^2.
"""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.cameras import ExposureSettings, LensSettings
from sumo3dviz_pt.job.settings import CameraSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Production


log = logging.getLogger(__name__)

FRAMES = 5
"""How many frames of a shot are metered, at most."""

KEY = 0.18
"""Share of white to which the log-average of a sunny street is brought."""

_WIDTH, _SPP = 96, 4
"""Width of metering pictures [px], and samples of each of their pixels."""

_SUNNY = 3000.0
"""Luminance of a sunny street, for which the key is given [cd/m^2]."""

_TRIMMED = 0.05
"""Share of the darkest and of the brightest pixels that do not count."""

_STEP = 0.1
"""Exposures are multiples of this [EV], so that they are the same on every processor."""

_SATURATION = 78.0 / 0.65
"""White, in cd/m^2, is this times N^2 / (t S)."""

_BRIGHT = 0.97
"""Share of pixels that are not to be brighter than white."""

_CABIN = 3.0
"""What is nearer to a camera that rides is its own vehicle [m]."""

_LEAST = 1e-7
"""Darker pixels count as so dark [scene units]."""


def exposure_of(
    settings: ExposureSettings | None, *, sky: float, metered: float | None, by_hand: float
) -> float:
    """Return the EV between radiance and a camera's pictures, but for the film's own.

    Args:
        settings: Of the camera.
        sky: At which its sky looks right [EV].
        metered: What was metered, where the mode is `auto` [EV].
        by_hand: What lens, shutter and ISO give, where the mode is `manual` [EV].
    """
    chosen = settings or ExposureSettings()
    if chosen.mode == "fixed":
        return chosen.ev
    if chosen.mode == "manual":
        return by_hand + chosen.ev
    if chosen.mode == "auto":
        return (sky if metered is None else metered) + chosen.ev
    return sky + chosen.ev


def manual_exposure(camera: CameraSettings, *, step: float, name: str) -> float:
    """Return the EV that f-number, shutter and ISO of a camera give.

    Args:
        camera: Its settings.
        step: From a frame to the next [s].
        name: Of the camera.

    Raises:
        ConfigError: If it has no f-number or no shutter.
    """
    settings, lens = camera.exposure or ExposureSettings(), camera.lens or LensSettings()
    if lens.f_number is None or camera.shutter is None or camera.shutter.span(step) <= 0.0:
        raise ConfigError(
            "a manual exposure needs an f_number in `lens` and an angle or time in `shutter`, such"
            " as `lens: {f_number: 8}` and `shutter: {time: 1/100 s}`",
            key=f"cameras.{name}.exposure",
        )
    span = camera.shutter.span(step)
    white = _SATURATION * lens.f_number**2 / (span * settings.iso)
    return math.log2(CANDELAS_PER_UNIT / white)


def is_metered(production: Production) -> bool:
    """Return whether a production's exposure is metered."""
    settings = production.settings.exposure
    return settings is not None and settings.mode == "auto"


def metered(production: Production, locked: float | None = None) -> Production:
    """Return a production whose exposure is known: metered, if its camera wants that.

    Args:
        production: The shot.
        locked: What was metered elsewhere, for all shots of a study [EV]; None meters.
    """
    if not is_metered(production) or production.metered is not None:
        return production
    value = _meter(production) if locked is None else locked
    log.info("camera %s is exposed for %+.1f EV, metered", production.camera, value)
    return replace(production, metered=value)


def metering_of(production: Production) -> dict[str, Any]:
    """Return what an account says of an exposure; nothing where the camera says nothing of it."""
    settings = production.settings.exposure
    if settings is None:
        return {}
    how: dict[str, Any] = {"mode": settings.mode, "ev": settings.ev}
    if production.metered is not None:
        how["metered"] = production.metered
    if settings.mode == "manual":
        how["iso"] = settings.iso
    return {"metering": how}


def luminances(radiance: Floats, surface: Floats) -> Floats:
    """Return the luminances that matter in some pictures, sorted, (m,), in scene units.

    Args:
        radiance: Of all pixels, (n, 3), scene units.
        surface: Share of each pixel that shows a surface, (n,).
    """
    seen = surface > 0.5
    pixels = radiance[seen] if seen.mean() > 0.1 else radiance
    return np.sort(np.maximum(pixels @ LUMINANCE, _LEAST))


def log_average(levels: Floats) -> float:
    """Return the typical one of sorted luminances, without the darkest and the brightest."""
    cut = int(_TRIMMED * len(levels))
    return float(2.0 ** np.log2(levels[cut : len(levels) - cut]).mean())


def exposure_for(levels: Floats) -> float:
    """Return the exposure [EV] that brings sorted luminances [scene units] to their key."""
    level, bright = log_average(levels), float(levels[int(_BRIGHT * (len(levels) - 1))])
    key = KEY * _adapted(level * CANDELAS_PER_UNIT) / _adapted(_SUNNY)
    wanted = min(math.log2(key / level), -math.log2(bright))
    return round(round(wanted / _STEP) * _STEP, 6)


def _adapted(luminance: float) -> float:
    """Return the key of a luminance [cd/m^2], by Krawczyk and others."""
    return 1.03 - 2.0 / (2.0 + math.log10(luminance + 1.0))


def _meter(production: Production) -> float:
    """Return the exposure of a shot by some of its frames [EV]."""
    from sumo3dviz_pt.render.backend import choose_backend
    from sumo3dviz_pt.render.session import RenderSettings, Session

    times = production.times
    some = np.unique(np.linspace(0, len(times) - 1, min(FRAMES, len(times))).round().astype(int))
    frames = [production.shot.frame_at(float(times[number])) for number in some]
    width, height = production.job.output.size
    size = (_WIDTH, 2 * max(1, round(_WIDTH * height / width / 2)))
    changes = {"spp": _SPP, "pass_spp": _SPP, "denoise": "none", "accumulate": 0}
    settings = RenderSettings(
        size,
        production.quality.model_copy(update=changes),
        production.job.seed,
        white=2.0**-production.shot.data.sky.exposure,
        pixel=frames[0].view.pixel_angle(size[0]),
        layers=("radiance", "hit", "depth"),
    )
    samples = []
    with Session(production.shot.data, choose_backend(production.variant), settings) as session:
        for frame in frames:
            layers = session.render(frame).layers
            pixels = layers["radiance"].reshape(-1, 3).astype(np.float64)
            hit, depth = layers["hit"].reshape(-1), layers["depth"].reshape(-1)
            outside = (depth > _CABIN) | (hit < 0.5) | (frame.view.rides_in is None)
            samples.append((pixels[outside], hit[outside].astype(np.float64)))
    radiance, surface = (np.concatenate(each) for each in zip(*samples, strict=True))
    return exposure_for(luminances(radiance, surface))
