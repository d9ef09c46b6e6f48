"""What ethics boards ask of films: flashes, red, signals for colour-blind people, size.

* flash: a pair of opposing changes of relative luminance by a tenth or more of the brightest white,
  of which the darker is below .8. Half a pair counts half;
* red flash: a pair of changes into or out of a saturated red, R / (R + G + B) of linear light at
  least .8, by more than .2 in the CIE 1976 chromaticity diagram; black counts as grey there;
* a film is as the criterion has it if no place's flashes are more than three within any second, or
  if such places fill at most a quarter of every field of view of 10 degrees. Fields are round, and
  laid over a film that is seen as wide as its lens opens: seen smaller, a field holds more of it.
  Places are blocks of the picture, 96 at most across, so that noise and grain are no flashes;
* colours of signals: means of the pixels that show a lens which shines by the signals' log, as the
  display shows them and as people see them who lack a cone: protanopia without long, deuteranopia
  without middle wavelengths (severity 1 of Machado et al.).
  Colour differences are CIEDE2000; about 2 is just seen side by side, and 10 at a glance.

References:
    W3C, Web Content Accessibility Guidelines 2.2, 2023, "general flash and red flash thresholds"
    and success criterion 2.3.1; Recommendation ITU-R BT.1702; ISO 9241-391:2016.
    Machado, Oliveira and Fernandes, "A physiologically-based model for simulation of color vision
    deficiency", IEEE TVCG 15, 2009, doi:10.1109/TVCG.2009.113.
    Sharma, Wu and Dalal, "The CIEDE2000 color-difference formula", Color Research and Application
    30, 2005, doi:10.1002/col.20070.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.layers import LUMINANCE, linear_from_srgb
from sumo3dviz_pt.world.signals.signals import GLASS

CHANGE = 0.1
"""Least change of relative luminance that is half a flash."""

DARKER = 0.8
"""Only pairs whose darker picture is below this relative luminance are flashes."""

RED = 0.8
"""Least share of red in a saturated red."""

APART = 0.2
"""Least change of chromaticity u', v' that is half a red flash."""

MOST_FLASHES = 3.0
"""Within a second, at places that fill more than `MOST_FIELD` of a field."""

MOST_FIELD = 0.25
FIELD = float(np.radians(10.0))

VISIONS: Mapping[str, str] = {"protanopia": "Protanomaly", "deuteranopia": "Deuteranomaly"}
"""How `colour` calls what people see who lack a cone."""

_ACROSS = 96
_BLACK = 1e-3  # linear light below which a colour has no chromaticity
_LINEAR = np.array([linear_from_srgb(code / 255.0) for code in range(256)])
_LIGHT = _LINEAR.astype(np.float32)
_WHITE = np.array([0.1978, 0.4683])  # u', v' of D65
_XYZ = np.array(  # of linear sRGB, IEC 61966-2-1
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)

Pixels = NDArray[np.uint8]


# Flashes ------------------------------------------------------------------------------------


@dataclass(slots=True)
class FlashMeter:
    """Counts the flashes of a film, frame by frame.

    Attributes:
        size: Width, height of the pictures [px].
        rate: Frames per second.
        pixels: How many pixels wide 10 degrees are.
    """

    size: tuple[int, int]
    rate: float
    pixels: float
    _side: int = 1
    _reach: float = 0.0
    _low: Floats | None = None
    _high: Floats | None = None
    _rises: NDArray[np.int8] | None = None
    _was: tuple[Bools, Floats] | None = None
    _recent: dict[str, deque[Bools]] = field(default_factory=dict)
    _found: dict[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Lay out the blocks."""
        self._side = max(-(-self.size[0] // _ACROSS), 1)
        self._reach = self.pixels / 2.0 / self._side
        length = max(round(self.rate), 1)
        for name in ("flash", "red_flash"):
            self._recent[name], self._found[name] = deque(maxlen=length), (0.0, 0.0)

    def add(self, picture: Pixels) -> None:
        """Take the next picture, (h, w, 3), sRGB codes."""
        light = _blocks(picture, self._side)
        for name, turns in (("flash", self._turns(light)), ("red_flash", self._reddens(light))):
            recent = self._recent[name]
            recent.append(turns)
            if any(each.any() for each in recent):
                self._weigh(name, 0.5 * np.sum(recent, axis=0))

    def result(self) -> dict[str, float]:
        """Return the most flashes in a second, and the most of a field that flashes too often."""
        measures: dict[str, float] = {}
        for name, (most, area) in self._found.items():
            measures[f"{name}_rate"], measures[f"{name}_area"] = most, round(area, 4)
        return measures

    def _weigh(self, name: str, flashes: Floats) -> None:
        """Note how often a quarter of a field flashes, and how much of one does so too often."""
        most, area = self._found[name]
        area = max(area, _largest_share(flashes > MOST_FLASHES, self._reach))
        for level in np.unique(flashes[flashes > most]).tolist():
            if _largest_share(flashes >= level, self._reach) <= MOST_FIELD:
                break
            most = level
        self._found[name] = (most, area)

    def _turns(self, light: Floats) -> Bools:
        """Return where luminance has turned and changed enough since, (h, w)."""
        shown = light @ LUMINANCE
        if self._low is None or self._high is None or self._rises is None:
            self._low, self._high = shown.copy(), shown.copy()
            self._rises = np.zeros(shown.shape, dtype=np.int8)
        self._low, self._high = np.minimum(self._low, shown), np.maximum(self._high, shown)
        # Sums of floats must not decide whether a tenth is a tenth.
        step = CHANGE - 1e-6
        up = (self._rises <= 0) & (shown - self._low >= step) & (self._low < DARKER)
        down = (self._rises >= 0) & (self._high - shown >= step) & (shown < DARKER) & ~up
        self._rises[up], self._rises[down] = 1, -1
        turned = up | down
        self._low[turned] = self._high[turned] = shown[turned]
        return np.asarray(turned)

    def _reddens(self, light: Floats) -> Bools:
        """Return where a saturated red has come or gone, (h, w)."""
        whole = light.sum(axis=-1)
        seen = whole > _BLACK
        red = seen & (light[..., 0] >= RED * whole)
        place = np.where(seen[..., None], chromaticity(light), _WHITE)
        if self._was is None:
            self._was = (red, place)
        before, ago = self._was
        changed = (red != before) & (np.linalg.norm(place - ago, axis=-1) > APART)
        stays = red == before
        self._was = (
            np.where(changed, red, before),
            np.where((changed | stays)[..., None], place, ago),
        )
        return np.asarray(changed)


def chromaticity(light: Floats) -> Floats:
    """Return u', v' of the CIE 1976 diagram of linear sRGB, (..., 2); of black NaN."""
    x, y, z = np.moveaxis(light @ _XYZ.T, -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        whole = x + 15.0 * y + 3.0 * z
        return np.stack([4.0 * x / whole, 9.0 * y / whole], axis=-1)


def _blocks(picture: Pixels, side: int) -> Floats:
    """Return linear light over square blocks of a picture, (h / side, w / side, 3)."""
    height, width = (length // side for length in picture.shape[:2])
    light = _LIGHT[picture[: height * side, : width * side]]
    rows = light.reshape(height, side, -1).sum(axis=1)
    return np.asarray(rows.reshape(height, width, side, 3).sum(axis=2) / side**2, dtype=float)


def _largest_share(marked: Bools, reach: float) -> float:
    """Return the largest share of any round field of a radius that is marked."""
    from scipy.signal import fftconvolve

    if not marked.any():
        return 0.0
    steps = np.arange(-int(reach), int(reach) + 1)
    disc = (np.hypot(steps[:, None], steps[None, :]) <= reach).astype(float)
    covered = fftconvolve(marked.astype(float), disc, mode="full")
    return float(np.round(covered.max()) / disc.sum())


# Colours of signals -------------------------------------------------------------------------


@dataclass(slots=True)
class SignalColours:
    """Collects the colours of lights that shine, as pictures show them."""

    _sums: dict[str, Floats] = field(default_factory=dict)

    def add(self, picture: Pixels, lenses: Mapping[str, Ints]) -> None:
        """Take a picture.

        Args:
            picture: (h, w, 3), sRGB codes.
            lenses: Which of its pixels show lenses that shine, by their names in `GLASS`.
        """
        for name, places in lenses.items():
            own = _LINEAR[picture.reshape(-1, 3)[places]]
            total = np.append(own.sum(axis=0), len(own))
            self._sums[name] = self._sums.get(name, np.zeros(4)) + total

    def differences(self) -> dict[str, float]:
        """Return colour differences of lights by their names and by vision; NaN of unseen ones."""
        means = {name: each[:3] / each[3] for name, each in self._sums.items() if each[3] > 0}
        return {
            f"{one}_{other}_{vision}": (
                colour_difference(means[one], means[other], vision)
                if one in means and other in means
                else float("nan")
            )
            for one, other in combinations(GLASS, 2)
            for vision in ("normal", *VISIONS)
        }


def colour_difference(one: Floats, other: Floats, vision: str) -> float:
    """Return the CIEDE2000 difference of two colours as some people see them.

    Args:
        one: Linear sRGB, (3,), of a display whose white is 1.
        other: The same.
        vision: `normal`, or of `VISIONS`.
    """
    import colour

    lab = _lab(np.stack([seen_with(one, vision), seen_with(other, vision)]))
    return float(colour.delta_E(lab[0], lab[1], method="CIE 2000"))


def seen_with(light: Floats, vision: str) -> Floats:
    """Return linear sRGB as somebody sees it who lacks a cone, (..., 3) in [0, 1]."""
    import colour

    if vision == "normal":
        return light
    matrix = colour.matrix_cvd_Machado2009(VISIONS[vision], 1.0)
    return np.clip(light @ np.asarray(matrix).T, 0.0, 1.0)


def _lab(light: Floats) -> Floats:
    """Return CIE Lab of linear sRGB under D65, (..., 3)."""
    import colour

    return np.asarray(colour.XYZ_to_Lab(light @ _XYZ.T))


# Sizes --------------------------------------------------------------------------------------


def size_row(files: Sequence[Path], connections: Sequence[float]) -> dict[str, float]:
    """Return how large a film is [MB], and how long it takes to load by connection [s].

    Args:
        files: Of the film.
        connections: [Mbit/s].
    """
    size = sum(path.stat().st_size for path in files) / 1e6
    return {"megabytes": size, **{f"load_{rate:g}": 8.0 * size / rate for rate in connections}}


# The verdict --------------------------------------------------------------------------------


def safety_words(connections: Sequence[float]) -> dict[str, str]:
    """Return what these numbers mean, by name, in the order in which they are shown."""
    pairs = {
        f"{one}_{other}_{vision}": f"colour difference of {one} and {other} lights to {whom}"
        for one, other in combinations(GLASS, 2)
        for vision, whom in {"normal": "all cones", **{name: name for name in VISIONS}}.items()
    }
    return {
        "flash_rate": "most flashes in a second over a quarter of a field of 10 degrees",
        "flash_area": "most of such a field that flashes more than three times in a second",
        "red_flash_rate": "most red flashes in a second over a quarter of such a field",
        "red_flash_area": "most of such a field with more than three red flashes in a second",
        "shown_peak": "peak luminance of the picture [cd/m2]",
        **pairs,
        "megabytes": "size of the film [MB]",
        **{f"load_{rate:g}": f"time to load at {rate:g} Mbit/s [s]" for rate in connections},
    }


def flashes_too_often(measures: Mapping[str, float]) -> list[str]:
    """Return which of flashes and red flashes are more often than the criterion lets them."""
    kinds = {"flash_rate": "flashes", "red_flash_rate": "red flashes"}
    return [words for name, words in kinds.items() if measures[name] > MOST_FLASHES]
