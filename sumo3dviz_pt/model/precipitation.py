"""Drops and flakes: how many of each size there are, and how fast they fall.

Numbers are per cubic metre and millimetre of diameter; a snowflake's size is that of the drop that
it melts to, from which the size of the flake follows.

References:
    Marshall, J. S. and Palmer, W. M., The distribution of raindrops with size, Journal of
    Meteorology 5, 1948: 8000 exp(-4.1 R^-0.21 D) drops per m^3 and mm.
    Atlas, D., Srivastava, R. C. and Sekhon, R. S., Doppler radar characteristics of
    precipitation at vertical incidence, Reviews of Geophysics 11, 1973: 9.65 - 10.3 exp(-0.6 D)
    m/s, fitted to what Gunn and Kinzer measured, Journal of Meteorology 6, 1949.
    Gunn, K. L. S. and Marshall, J. S., The distribution with size of aggregate snowflakes,
    Journal of Meteorology 15, 1958: 3800 R^-0.87 exp(-2.55 R^-0.48 D).
    Langleben, M. P., The terminal velocity of snowflakes, Quarterly Journal of the Royal
    Meteorological Society 80, 1954: 1.6 (D / 1 cm)^0.3 m/s.
    Holroyd, E. W., The meso- and microscale structure of Great Lakes snowstorm bands, 1971:
    aggregates have a density of .17 g/cm^3 divided by their diameter in millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats

_WATER, _FLAKE = 1.0, 0.17  # densities [g/cm^3]; a flake's is divided by its diameter in mm


@dataclass(frozen=True, slots=True)
class Sizes:
    """An exponential distribution of sizes.

    Attributes:
        most: Number of the smallest, per cubic metre and millimetre.
        slope: By which numbers fall [1/mm].
    """

    most: float
    slope: float

    def above(self, diameter: Floats | float) -> Floats:
        """How many are larger than a diameter [mm], per cubic metre."""
        return np.asarray(self.most / self.slope * np.exp(-self.slope * np.asarray(diameter)))

    def share_at(self, share: Floats, low: Floats | float, high: Floats | float) -> Floats:
        """Diameters between two others [mm], spread as this distribution is.

        Args:
            share: Of those between that are smaller, [0, 1].
            low: The least diameter [mm].
            high: The largest [mm].
        """
        kept = -np.expm1(-self.slope * (np.asarray(high) - low))
        return np.asarray(low - np.log1p(-share * kept) / self.slope)


def rain_sizes(rate: float) -> Sizes:
    """Return the drops of a rain, by the diameter of the drop.

    Args:
        rate: More than 0 [mm/h].
    """
    return Sizes(8000.0, 4.1 * rate**-0.21)


def snow_sizes(rate: float) -> Sizes:
    """Return the flakes of a snowfall, by the diameter of the drop that each melts to.

    Args:
        rate: As water, more than 0 [mm/h].
    """
    return Sizes(3800.0 * rate**-0.87, 2.55 * rate**-0.48)


def drop_speed(diameter: Floats | float) -> Floats:
    """Return how fast drops of a diameter [mm] fall in still air [m/s]."""
    return np.asarray(np.maximum(9.65 - 10.3 * np.exp(-0.6 * np.asarray(diameter)), 0.1))


def flake_speed(melted: Floats | float) -> Floats:
    """Return how fast flakes fall, by the diameter that they melt to [mm], in still air [m/s]."""
    return np.asarray(1.6 * (np.asarray(melted) / 10.0) ** 0.3)


def flake_diameter(melted: Floats | float) -> Floats:
    """Return the diameter of flakes [mm], by that of the drop that each melts to [mm]."""
    # Equal mass: water x melted^3 = (.17 / diameter) x diameter^3.
    return np.asarray(np.sqrt(_WATER / _FLAKE * np.asarray(melted) ** 3))
