"""Sound power of road users by speed and acceleration, in octave bands of 63 Hz to 8 kHz.

Road vehicles are those of CNOSSOS-EU: rolling noise grows with the logarithm of speed, propulsion
noise with speed, about 70 km/h, on the reference road surface, dry, at 20 degrees Celsius. A source
sends its sound into the half space above the road; what the road reflects is part of its power.

CNOSSOS-EU holds the level of 20 km/h below that speed, as noise maps need. A standing car has no
tyre noise, so here rolling noise goes on falling, and propulsion noise falls by 8 dB down to
standstill; both are our own choices. Noise maps tell acceleration by how far a crossing is; as we
know it itself, propulsion noise follows it as in Harmonoise: by 4.4 dB for each m/s2 of light
vehicles and 5.6 dB of heavy ones, within +-2 m/s2.

Electric cars have no propulsion noise, and the warning sound that they must make at low speed
(AVAS) is not modelled.

Rail vehicles have the rolling noise of CNOSSOS-EU: roughness of wheels with disc brakes and of a
rail of EN ISO 3095, filtered by the contact of a wheel of 920 mm at 50 kN, and transferred by
wheels and by a track of concrete sleepers on pads of medium stiffness. Their traction, squeal,
impacts, horns and directivity are left out. How many axles they have, one to 6.25 m, is our own
guess. Below 5 km/h their level falls by 20 dB for each tenth of the speed, our own choice.

Bicycles hiss softly, by a level of our own; who walks is silent.

References:
    Commission Directive (EU) 2015/996, Annex, 2.2 and 2.3; coefficients of Table F-1 as amended by
        Commission Delegated Directive (EU) 2021/1226; checked against `RoadCnossos_2020.json` and
        `RailwayCnossosEU_2020.json` of https://github.com/Universite-Gustave-Eiffel/NoiseModelling.
    Harmonoise's terms of acceleration as in SUMO, `src/utils/emissions/HelpersHarmonoise.cpp`.
    IEC 61672-1, table 3: A-weighting at the bands' centres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import RAIL_CLASSES, VehicleType

BANDS = np.array([63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0])
"""Centres of the octave bands [Hz]."""

A_WEIGHTS = np.array([-26.2, -16.1, -8.6, -3.2, 0.0, 1.2, 1.0, -1.1])
"""A-weighting at the bands' centres [dB]."""

SILENT = -200.0
"""Level of what makes no sound [dB]."""

_REFERENCE = 70.0  # [km/h]
_SLOWEST = 20.0  # to which formulas hold [km/h]
_IDLE = 8.0  # by which engines at standstill are softer than at that speed [dB]
_HARD = 2.0  # acceleration up to which propulsion noise follows it [m/s2]


@dataclass(frozen=True, slots=True)
class Category:
    """Coefficients of a category of road vehicles, a number for each band.

    Attributes:
        rolling: At 70 km/h [dB]; None for two-wheelers, whose tyres do not count.
        rolling_slope: By the logarithm of speed [dB].
        propulsion: At 70 km/h [dB].
        propulsion_slope: By speed [dB].
        per_acceleration: What propulsion noise gains [dB per m/s2].
        idle: Ignitions in a second at standstill [Hz].
        firing: The same in the middle of a gear's range [Hz].
    """

    rolling: tuple[float, ...] | None
    rolling_slope: tuple[float, ...] | None
    propulsion: tuple[float, ...]
    propulsion_slope: tuple[float, ...]
    per_acceleration: float
    idle: float
    firing: float


CATEGORIES: Mapping[str, Category] = {
    "1": Category(
        (83.1, 89.2, 87.7, 93.1, 100.1, 96.7, 86.8, 76.2),
        (30.0, 41.5, 38.9, 25.7, 32.5, 37.2, 39.0, 40.0),
        (97.9, 92.5, 90.7, 87.2, 84.7, 88.0, 84.4, 77.1),
        (-1.3, 7.2, 7.7, 8.0, 8.0, 8.0, 8.0, 8.0),
        *(4.4, 26.0, 60.0),
    ),
    "2": Category(
        (88.7, 93.2, 95.7, 100.9, 101.7, 95.1, 87.8, 83.6),
        (30.0, 35.8, 32.6, 23.8, 30.1, 36.2, 38.3, 40.1),
        (105.5, 100.2, 100.5, 98.7, 101.0, 97.8, 91.2, 85.0),
        (-1.9, 4.7, 6.4, 6.5, 6.5, 6.5, 6.5, 6.5),
        *(5.6, 30.0, 70.0),
    ),
    "3": Category(
        (91.7, 96.2, 98.2, 104.9, 105.1, 98.5, 91.1, 85.6),
        (30.0, 33.5, 31.3, 25.4, 31.8, 37.1, 38.6, 40.6),
        (108.8, 104.2, 103.5, 102.9, 102.6, 98.5, 93.8, 87.5),
        (0.0, 3.0, 4.6, 5.0, 5.0, 5.0, 5.0, 5.0),
        *(5.6, 30.0, 65.0),
    ),
    "4a": Category(
        None,
        None,
        (93.0, 93.0, 93.5, 95.3, 97.2, 100.4, 95.8, 90.9),
        (4.2, 7.4, 9.8, 11.6, 15.7, 18.9, 20.3, 20.6),
        *(4.4, 30.0, 110.0),
    ),
    "4b": Category(
        None,
        None,
        (99.9, 101.9, 96.7, 94.4, 95.2, 94.7, 92.1, 88.6),
        (3.2, 5.9, 11.9, 11.6, 11.5, 12.6, 11.1, 12.0),
        *(4.4, 22.0, 75.0),
    ),
}
"""CNOSSOS-EU: light, medium heavy and heavy vehicles, mopeds and motorcycles."""

_SILENT_CLASSES = frozenset(
    ["pedestrian", "wheelchair", "scooter", "ship", "container", "cable_car", "aircraft", "drone"]
)
_BY_CLASS = {"moped": "4a", "motorcycle": "4b", "trailer": "3"}
_HEAVY_FROM = {"bus": 13.5, "coach": 13.5, "truck": 10.0}
"""Length from which vehicles of a class are taken to have three or more axles [m]."""


def category_of(kind: VehicleType) -> str:
    """Return how a road user sounds: a key of `CATEGORIES`, `rail`, `bicycle` or `silent`."""
    vclass = kind.vclass
    if vclass in _SILENT_CLASSES:
        return "silent"
    if vclass in RAIL_CLASSES:
        return "rail"
    if vclass == "bicycle":
        return "bicycle"
    if vclass in _HEAVY_FROM:
        return "3" if kind.length >= _HEAVY_FROM[vclass] else "2"
    return _BY_CLASS.get(vclass, "1")


def is_electric(kind: VehicleType) -> bool:
    """Return whether a type has no engine that burns: by its class, emission class or battery."""
    words = kind.params.get("emissionClass", "").lower()
    powered = kind.params.get("has.battery.device", "").lower() in ("true", "1")
    return kind.vclass == "evehicle" or words.startswith(("energy", "mmpevem")) or powered


@dataclass(frozen=True, slots=True, eq=False)
class Emission:
    """Sound power levels of a source.

    Attributes:
        rolling: Of wheels, (n, 8) [dB re 1 pW].
        propulsion: Of the engine, (n, 8) [dB re 1 pW].
        firing: Ignitions in a second, (n,) [Hz]; 0 where there is no engine.
    """

    rolling: Floats
    propulsion: Floats
    firing: Floats

    @property
    def total(self) -> Floats:
        """Of both together, (n, 8) [dB re 1 pW]."""
        power = 10.0 ** (0.1 * self.rolling) + 10.0 ** (0.1 * self.propulsion)
        return np.asarray(10.0 * np.log10(power))

    def split(self, parts: int) -> Emission:
        """Return what each of some equal parts sends."""
        share = 10.0 * np.log10(parts)
        return Emission(self.rolling - share, self.propulsion - share, self.firing)


def emission_of(kind: VehicleType, speeds: Floats, accelerations: Floats) -> Emission:
    """Return the sound power of a road user.

    Args:
        kind: Its vType.
        speeds: (n,) [m/s]; NaN counts as standing.
        accelerations: Along the path, (n,) [m/s2]; NaN counts as none.
    """
    speed = 3.6 * np.abs(np.nan_to_num(speeds))
    name = category_of(kind)
    none, still = np.full((len(speed), len(BANDS)), SILENT), np.zeros(len(speed))
    if name == "rail":
        return Emission(rail_rolling(speed, max(kind.length / _PER_AXLE, 2.0)), none, still)
    if name == "bicycle":
        return Emission(_HISS + 30.0 * _lg(speed / 18.0)[:, None], none, still)
    if name == "silent":
        return Emission(none, none, still)
    own = CATEGORIES[name]
    rolling = none if own.rolling is None else road_rolling(own, speed)
    if is_electric(kind):
        return Emission(rolling, none, still)
    gain = own.per_acceleration * np.clip(np.nan_to_num(accelerations), -_HARD, _HARD)
    # An engine does not brake below its idle level.
    gain = np.where(speed < _SLOWEST, np.maximum(gain, 0.0), gain)
    propulsion = road_propulsion(own, speed) + gain[:, None]
    return Emission(rolling, propulsion, _firing(own, speed, gain))


def road_rolling(own: Category, speed: Floats) -> Floats:
    """Return the power level of tyres, (n, 8) [dB]; CNOSSOS-EU 2.2.4.

    Args:
        own: Coefficients, with tyres.
        speed: (n,) [km/h].
    """
    assert own.rolling is not None
    ratio = _lg(speed / _REFERENCE)[:, None]
    return np.asarray(np.array(own.rolling) + np.array(own.rolling_slope) * ratio)


def road_propulsion(own: Category, speed: Floats) -> Floats:
    """Return the power level of engines, (n, 8) [dB]; CNOSSOS-EU 2.2.11.

    Args:
        own: Coefficients.
        speed: (n,) [km/h].
    """
    driven = (np.maximum(speed, _SLOWEST) - _REFERENCE) / _REFERENCE
    idle = _IDLE * (1.0 - np.minimum(speed / _SLOWEST, 1.0))
    levels = np.array(own.propulsion) + np.array(own.propulsion_slope) * driven[:, None]
    return np.asarray(levels - idle[:, None])


def _lg(ratio: Floats) -> Floats:
    """Return a logarithm that ends where nothing is heard any more."""
    return np.asarray(np.log10(np.maximum(ratio, 1e-3)))


_GEARS = np.array([0.0, 18.0, 33.0, 52.0, 75.0, 105.0])
"""Speed from which each gear is driven [km/h]."""

_SHIFT = 2.0  # speed over which one gear gives way to the next [km/h]


def _firing(own: Category, speed: Floats, gain: Floats) -> Floats:
    """Return ignitions in a second, (n,) [Hz]: our own simple gearbox, without steps.

    In a gear the rate is in proportion to speed and reaches 1.3 of its middle; gears change over
    2 km/h; who accelerates turns up to a fifth faster.
    """
    tops = np.append(_GEARS[1:], 160.0)
    share = 1.0 / (1.0 + np.exp(-(speed[:, None] - _GEARS[1:]) / (0.25 * _SHIFT)))
    weights = np.append(np.ones((len(speed), 1)), share, axis=1)
    weights[:, :-1] -= share
    rate = (weights * (1.3 * own.firing * speed[:, None] / tops)).sum(axis=1)
    return np.asarray(np.hypot(own.idle, rate) * (1.0 + 0.02 * np.clip(gain, 0.0, 10.0)))


_HISS = np.array([30.0, 32.0, 36.0, 42.0, 46.0, 48.0, 46.0, 40.0])
"""Power level of a bicycle at 18 km/h, our own [dB]."""


# Rails -------------------------------------------------------------------------------------

_PER_AXLE = 6.25  # [m]
_CREEP = 5.0  # [km/h]

_THIRDS = 1000.0 * 10.0 ** (np.arange(-13, 11) / 10.0)
"""Centres of the bands of a third octave, 50 Hz to 10 kHz [Hz]: three to each octave."""

_WAVES = 2.0 * 10.0 ** (-np.arange(35) / 10.0)
"""Wavelengths of roughness, 2 m to 0.8 mm [m]."""

_WHEEL = np.array(
    [-5.9] * 9
    + [2.3, 2.8, 2.6, 1.2, 2.1, 0.9, -0.3, -1.6, -2.9, -4.9, -7.0, -8.6, -9.3, -9.5, -10.1, -10.3]
    + [-10.3, -10.8, -10.9]
    + [-9.5] * 7
)  # fmt: skip
_RAIL = np.array(
    [17.1] * 8
    + [15.0, 13.0, 11.0, 9.0, 7.0, 4.9, 2.9, 0.9, -1.1, -3.2, -5.0, -5.6, -6.2, -6.8, -7.4, -8.0]
    + [-8.6, -9.2, -9.8, -10.4, -11.0, -11.6, -12.2, -12.8, -13.4, -14.0, -14.0]
)  # fmt: skip
_CONTACT = np.array(
    [0.0] * 12
    + [-0.1, -0.1, -0.3, -0.6, -1.1, -1.3, -3.5, -5.3, -8.0, -12.0, -16.8, -17.7, -18.0, -21.5]
    + [-21.8, -22.8, -24.0, -24.5, -25.0, -27.3, -28.1, -28.9, -29.7]
)  # fmt: skip
"""Roughness of wheels and rails, and what their contact takes of it, by wavelength [dB re 1 um]."""

_OF_WHEELS = np.array(
    [75.4, 77.3, 81.1, 84.1, 83.3, 84.3, 86.0, 90.1, 89.8, 89.0, 88.8, 90.4,
     92.4, 94.9, 100.4, 104.6, 109.6, 114.9, 115.0, 115.0, 115.5, 115.6, 116.0, 116.7]
)  # fmt: skip
_OF_TRACK = np.array(
    [50.9, 57.8, 66.5, 76.8, 80.9, 83.3, 85.8, 90.0, 91.6, 93.9, 95.6, 97.4,
     101.7, 104.4, 106.0, 106.8, 108.3, 108.9, 109.1, 109.4, 109.9, 109.9, 110.3, 111.0]
)  # fmt: skip
"""Power of one axle at a roughness of 0 dB, by frequency [dB]."""


def rail_rolling(speed: Floats, axles: float) -> Floats:
    """Return the power level of wheels on rails, (n, 8) [dB]; CNOSSOS-EU 2.3.7 to 2.3.10.

    Args:
        speed: (n,) [km/h].
        axles: How many.
    """
    both = 10.0 ** (0.1 * _WHEEL) + 10.0 ** (0.1 * _RAIL)
    roughness = 10.0 * np.log10(both) + _CONTACT
    # Speed turns wavelengths into frequencies.
    waves = np.maximum(speed, 0.1)[:, None] / 3.6 / _THIRDS
    met = np.interp(np.log(waves), np.log(_WAVES[::-1]), roughness[::-1])
    transfer = 10.0 * np.log10(10.0 ** (0.1 * _OF_WHEELS) + 10.0 ** (0.1 * _OF_TRACK))
    thirds = 10.0 ** (0.1 * (met + transfer + 10.0 * np.log10(axles)))
    creeping = 20.0 * np.minimum(_lg(speed / _CREEP), 0.0)
    octaves = thirds.reshape(len(speed), len(BANDS), 3).sum(axis=2)
    return np.asarray(10.0 * np.log10(octaves) + creeping[:, None])
