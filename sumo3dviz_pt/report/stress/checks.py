"""Judges pictures by what must hold wherever the camera stands and whatever the sun does.

Beside NaN, Inf and negative values, energy is bounded. Nothing in a scene of passive
surfaces is brighter than its brightest light, so no value may exceed the larger of that
and the firefly cap. That alone would not notice surfaces that shine twice as bright as
they should, so there is a closer bound on the mean of what is not sky: a white wall that
faces all directional light E (the sun, and the part of the sky above the radiance c that
99.9 % of all directions stay below) and mirrors the rest of the sky is not brighter than
c + E / pi (Lambert). After sunset lamps light the road, and no surface gets brighter than
they are; that is a loose bound. The brightest hundredth of the pixels may be glints of the sun and
is left out of that mean. Open sky is simpler: its median lies between the darkest and the
brightest part of the baked sky, or is brighter by what lamps can add by night to air that
scatters their light; that is a loose bound, too.
Towards black, the outdoors is at least `DARKEST` of the sky's mean radiance: asphalt
reflects 0.05 of it, and a tenth of the sky is open to the depth of a street.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.scene import FrameState, LampSet, RunningLights, SceneData
from sumo3dviz_pt.report.stress.cases import Case

MARGIN = 1.05
"""Factor on the bounds that leaves room for rounding and noise."""

DARKEST = 0.002
"""Mean of a picture outdoors over the sky's mean, at least."""

_COMMON = 0.999
_GLINTS = 0.01
_MANY = 16  # pixels; fewer may lie on the edge of something dark


@dataclass(frozen=True, slots=True)
class CaseLight:
    """What shines in a case, all in scene units.

    Attributes:
        brightest: Highest channel value of sky, sun and lamps.
        common: Luminance that 99.9 % of the sky's directions stay below.
        directed: Irradiance of all that is brighter, on a plane facing it.
        mean: Cosine-weighted mean luminance of the upper half of the sky, without the sun.
        sky: Lowest and highest luminance of the sky, without the sun.
        sun: Luminance of the sun's disc; 0 for none.
        lamps: Luminance of the brightest lamp that lights its surroundings (after sunset).
        misty: Whether it is dark, and the air scatters the lamps' light towards the eye.
    """

    brightest: float
    common: float
    directed: float
    mean: float
    sky: tuple[float, float]
    sun: float = 0.0
    lamps: float = 0.0
    misty: bool = False

    @property
    def open_sky(self) -> tuple[float, float]:
        """Lowest and highest luminance that the open sky can have, air before it included."""
        low, high = self.sky
        return low, high + self.lamps * self.misty

    @property
    def wall(self) -> float:
        """Luminance that the mean of surfaces cannot exceed."""
        return self.common + self.directed / np.pi + self.lamps


def light_of(
    sky: Any,
    sets: Sequence[LampSet],
    frame: FrameState,
    scene: SceneData | None = None,
    *,
    misty: bool = False,
) -> CaseLight:
    """Return the light of a case.

    Args:
        sky: The session's baked sky: `radiance` (h, w, 3) from zenith to nadir, and `sun`.
        sets: The scene's lamps.
        frame: For the radiance of those that change.
        scene: For the lamps of its vehicles; None has none.
        misty: Whether it is dark, and the air scatters light as in fog, rain and falling snow.
    """
    luminance = np.asarray(sky.radiance, np.float64) @ LUMINANCE
    rows, columns = luminance.shape
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    solid = np.sin(theta) * (np.pi / rows) * (2 * np.pi / columns)
    common = _quantile(luminance, solid)
    cosine = solid * np.maximum(np.cos(theta), 0.0)
    directed = float((np.maximum(luminance - common, 0.0) * solid[:, None]).sum())
    sun = np.zeros(3) if sky.sun is None else np.asarray(sky.sun.radiance)
    lamps = [(each.sampled or each.radiance is not None, _peak(each, frame)) for each in sets]
    if scene is not None and scene.running is not None:
        lamps.append((scene.running.sampled, _lens(scene, scene.running)))
    lighting = [peak for lights, peak in lamps if lights]
    return CaseLight(
        brightest=float(np.max([sky.radiance.max(), sun.max(), *(p.max() for _, p in lamps)])),
        common=common,
        directed=directed + (0.0 if sky.sun is None else float(sky.sun.irradiance @ LUMINANCE)),
        mean=float((luminance.mean(axis=1) * cosine).sum() / cosine.sum()),
        sky=(float(luminance.min()), float(luminance.max())),
        sun=float(sun @ LUMINANCE),
        lamps=max((float(peak @ LUMINANCE) for peak in lighting), default=0.0),
        misty=misty,
    )


def _peak(lamps: LampSet, frame: FrameState) -> Floats:
    """Return the highest radiance of a set's lamps by channel, (3,)."""
    radiance = frame.lamps[lamps.id] if lamps.radiance is None else lamps.radiance
    return np.asarray(np.max(radiance, axis=0, initial=0.0) * max(lamps.lobe.floor, 1.0))


def _lens(scene: SceneData, running: RunningLights) -> Floats:
    """Return the highest radiance of vehicles' lenses by channel, (3,)."""
    # A hexagon fills this share of the lens's box.
    share = 3.0 / 4.0 * np.sin(np.pi / 3.0)
    lit = [
        np.array(running.intensity[lamp.role]) / (share * lamp.size[0] * lamp.size[1])
        for body in scene.prototypes.values()
        for lamp in body.lamps
        if lamp.role in running.intensity
    ]
    return np.asarray(np.max(lit, axis=0, initial=0.0) if lit else np.zeros(3))


def _quantile(luminance: Floats, solid: Floats) -> float:
    """Return what `_COMMON` of all directions stay below; rows weigh by solid angle, (h,) [sr]."""
    order = np.argsort(luminance, axis=None)
    weights = np.broadcast_to(solid[:, None], luminance.shape).ravel()[order]
    place = np.searchsorted(np.cumsum(weights), _COMMON * weights.sum())
    return float(luminance.ravel()[order[min(int(place), len(order) - 1)]])


@dataclass(frozen=True, slots=True, eq=False)
class CaseEvidence:
    """What came out of a case.

    Attributes:
        radiance: The picture, (h, w, 3).
        open_sky: Pixels that see no surface, (h, w).
        light: What shone.
        limit: Firefly cap, highest channel value of a sample.
        exposure: At which the picture is developed [EV].
        tone: Tone curve's name.
        again: The same case rendered anew, (h, w, 3), if asked for.
        stored: The picture after EXR, (h, w, 3), if asked for.
    """

    radiance: Image
    open_sky: Bools
    light: CaseLight
    limit: float
    exposure: float
    tone: str
    again: Image | None = None
    stored: Image | None = None


def judge(case: Case, seen: CaseEvidence) -> tuple[str, ...]:
    """Return what is wrong with a case's picture; empty if nothing is."""
    broken = unsound(seen.radiance, "the picture")
    if broken:
        return broken
    problems = [*_too_much(seen), *_too_little(case, seen), *_sky(seen), *_development(seen)]
    if seen.again is not None and not np.array_equal(seen.radiance, seen.again):
        changed = np.count_nonzero((seen.radiance != seen.again).any(axis=-1))
        problems.append(f"rendered again, {changed} of {seen.open_sky.size} pixels differ")
    return tuple(problems)


def unsound(radiance: Image, what: str) -> tuple[str, ...]:
    """Say which pixels hold values that no radiance can have."""
    finite = np.isfinite(radiance).all(axis=-1)
    negative = np.count_nonzero((radiance < 0).any(axis=-1))
    faults = []
    if not finite.all():
        faults.append(
            f"{np.count_nonzero(~finite)} of {finite.size} pixels of {what} are NaN or Inf"
        )
    if negative:
        faults.append(f"{negative} of {finite.size} pixels of {what} are negative")
    return tuple(faults)


def _too_much(seen: CaseEvidence) -> list[str]:
    """Say where the picture is brighter than its lights can make it."""
    faults = []
    peak, most = float(seen.radiance.max()), MARGIN * max(seen.light.brightest, seen.limit)
    if peak > most:
        faults.append(f"a pixel of {peak:.3g} is brighter than any light or the cap ({most:.3g})")
    surfaces = np.sort((seen.radiance @ LUMINANCE)[~seen.open_sky])
    plain = surfaces[: len(surfaces) - int(np.ceil(_GLINTS * len(surfaces)))]
    bound = MARGIN * seen.light.wall
    if len(plain) and plain.mean() > bound:
        faults.append(f"surfaces shine at {plain.mean():.3g}; a white wall would at {bound:.3g}")
    return faults


def _too_little(case: Case, seen: CaseEvidence) -> list[str]:
    """Say where light is lost, or where the picture shows nothing."""
    luminance = seen.radiance @ LUMINANCE
    faults = []
    if case.shows_sun and seen.light.sun > 0 and luminance.max() < 0.5 * seen.light.sun:
        faults.append(
            f"the sun's disc should be seen at {seen.light.sun:.3g};"
            f" the brightest pixel is {luminance.max():.3g}"
        )
    if case.may_be_dark:
        return faults
    least = DARKEST * seen.light.mean
    if luminance.mean() < least:
        faults.append(f"the picture is black: {luminance.mean():.3g}, not {least:.3g} or more")
    full_of_things = seen.open_sky.size > 1 and seen.open_sky.mean() < 0.75
    if full_of_things and (seen.radiance == seen.radiance[0, 0]).all():
        faults.append("the picture is blank: all pixels are the same")
    return faults


def _sky(seen: CaseEvidence) -> list[str]:
    """Say whether the open sky differs from the baked one."""
    if np.count_nonzero(seen.open_sky) < _MANY:
        return []
    median = float(np.median((seen.radiance @ LUMINANCE)[seen.open_sky]))
    low, high = seen.light.open_sky
    if low / MARGIN <= median <= high * MARGIN:
        return []
    return [f"the open sky shines at {median:.3g}, not from {low:.3g} to {high:.3g}"]


def _development(seen: CaseEvidence) -> list[str]:
    """Say what is wrong with the developed picture, also after storing."""
    from sumo3dviz_pt.image.tonemap import develop_float

    shown = develop_float(seen.radiance, exposure=seen.exposure, tone=seen.tone)
    if not (np.isfinite(shown).all() and shown.min() >= 0 and shown.max() <= 1):
        return ["the developed picture leaves [0, 1]"]
    if seen.stored is None:
        return []
    broken = unsound(seen.stored, "the stored picture")
    if broken:
        return list(broken)
    again = develop_float(seen.stored, exposure=seen.exposure, tone=seen.tone)
    codes = 255 * float(np.abs(again - shown).max())
    return [f"storing changes the film by {codes:.1f} of 255 codes"] if codes > 1 else []
