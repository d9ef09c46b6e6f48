"""A second, short pass: distances and hits for haze and cap, guides for the denoiser."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Channels, Layers
from sumo3dviz_pt.render.integrator import Integrator
from sumo3dviz_pt.render.kernels import load
from sumo3dviz_pt.render.sky.entries import SUN_DISTANCE


def is_guided(quality: Quality) -> bool:
    """Return whether a denoiser is guided by albedo and normals."""
    return quality.guides and quality.denoise != "none"


PICTURE = frozenset({"radiance", "capped", "lost"})
"""Layers that are found without the pass."""


def is_needed(quality: Quality, *, hazy: bool, layers: Collection[str]) -> bool:
    """Return whether a frame needs the pass at all.

    Args:
        quality: What the picture needs.
        hazy: Whether the scene has haze.
        layers: Those that are wanted besides.
    """
    needs = (hazy and quality.haze) or quality.denoise != "none" or quality.cap is not None
    return needs or not PICTURE.issuperset(layers)


def guide_spp(quality: Quality) -> int:
    """Return the samples of the pass: a quarter of the picture's, between 4 and 16.

    With fewer, haze is noisy where far ground meets the sky.
    """
    return min(max(quality.spp // 4, 4), 16)


LAMP_SPP = 16
"""Samples of a pass over lamps that are seen directly; more at once would take more memory."""


def lamp_passes(quality: Quality) -> int:
    """Return the passes over such lamps: up to eight times as many samples as the picture has.

    They cost little: paths end at the first surface.
    """
    return min(max(quality.spp // 4, 1), 4)


class _Aov(NamedTuple):
    """A layer of the first surface.

    Attributes:
        name: In Mitsuba's integrator `aov`.
        channels: How many it has there.
    """

    name: str
    channels: int


SURFACE = {"albedo": _Aov("albedo", 3), "normal": _Aov("sh_normal", 3)}
"""What the pass finds of the first surface, by the layer's name; one more needs only a row."""

_DISTANCE = Channels({"depth": slice(0, 1), "hit": slice(3, 4)}, 4)
"""Of the integrator `depth` on an `rgba` film: grey distances, and a share of hits as alpha."""

_EMISSION = Channels({"emitted": slice(0, 3)}, 4)
"""Of `_LAMPS` on an `rgba` film."""

_DEPTH: Mapping[str, Any] = {"type": "depth"}

_LAMPS: Mapping[str, Any] = {"type": "path", "max_depth": 1}
"""Sees what emits, and only that: paths end at the first surface."""


def guide_integrator(
    quality: Quality, *, jit: bool, lamps: bool = False, layers: Collection[str] = ()
) -> Integrator:
    """Load the integrator of the pass, for an `rgba` film.

    Args:
        quality: Says what is needed.
        jit: Whether the variant compiles. In others the pass only finds distances, because
            every `aov` sample waits for Python's lock there: it took five times as long as
            the picture.
        lamps: Whether it also finds where lamps are seen directly.
        layers: Those that are wanted besides what the quality needs.
    """
    surface_wanted = not SURFACE.keys().isdisjoint(layers)
    if not jit or not (is_guided(quality) or lamps or surface_wanted):
        return Integrator(load(_DEPTH), _DISTANCE)
    nested, channels = {"depth": _DEPTH}, _DISTANCE
    if lamps:
        nested, channels = {**nested, "lamps": _LAMPS}, channels + _EMISSION
    aovs = ",".join(f"{layer}:{aov.name}" for layer, aov in SURFACE.items())
    surface = Channels.in_order(**{layer: aov.channels for layer, aov in SURFACE.items()})
    return Integrator(load({"type": "aov", "aovs": aovs, **nested}), channels + surface)


def lamp_integrator() -> Integrator:
    """Load what finds `emitted` in a pass of its own, for an `rgba` film."""
    return Integrator(load(_LAMPS), _EMISSION)


def found_by(integrators: Iterable[Integrator]) -> set[str]:
    """Return the layers that `as_guides` makes of what the pass's integrators trace."""
    names = {name for integrator in integrators for name in integrator.channels.places}
    return names | {"lamp"} if "emitted" in names else names


def as_guides(traced: Layers) -> Layers:
    """Prepare what the pass found: the sun is no surface, and lamps are marked.

    Args:
        traced: `depth` and `hit`; `emitted`, `albedo` and `normal` if they were traced.

    Returns:
        The same layers with `hit` in [0, 1]; and `lamp` where there is `emitted`.
    """
    depth, hit = traced["depth"], np.clip(traced["hit"], 0.0, 1.0)
    # The sun's disc is an object only in the renderer: a ray that meets it has hit no surface.
    hit = np.where(depth > 0.1 * SUN_DISTANCE, 0.0, hit)
    if "emitted" not in traced:
        return traced | {"hit": hit}
    lit = traced["emitted"].max(axis=-1) > 0.0
    return traced | {"hit": hit, "lamp": (lit & (hit >= 1.0)).astype(np.float32)}


def uncapped(seen: Layers) -> Bools | None:
    """Return where emitters are seen directly, (h, w); None where no guides were traced."""
    if "hit" not in seen:
        return None
    return np.asarray((seen["hit"] < 1.0) | (seen.get("lamp", np.zeros(1)) > 0.0))


def excess(seen: Layers) -> Image:
    """Return what lamps that are seen directly emit, or what the cap took of it, (h, w, 3)."""
    if "glow" in seen:
        return seen["glow"]
    lost, lamp = seen["lost"], seen.get("lamp")
    return np.zeros_like(lost) if lamp is None else lost * lamp[..., None]
