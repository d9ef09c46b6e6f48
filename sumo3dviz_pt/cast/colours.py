"""Colours of vehicles and clothes: seeded per id, always one of a palette.

References:
    Shares after the annual colour popularity reports of paint makers for Europe
    (BASF, Axalta; about three quarters of new cars are white, black, grey or
    silver). The reflectances are our own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials.by_key import colour_of
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.random import pick, share_of
from sumo3dviz_pt.model.traffic import VehicleType


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours and how often they occur.

    Attributes:
        colours: Linear reflectances in [0, 0.85].
        shares: One for each colour, with a positive sum.
    """

    colours: tuple[Colour, ...]
    shares: tuple[float, ...]

    def draw(self, seed: int, key: str) -> Colour:
        """The colour of a road user: the same for the same seed and key."""
        return self.colours[pick(self.shares, share_of(seed, key, "colour"))]


EUROPEAN = Palette(
    (
        (0.62, 0.63, 0.625),  # white
        (0.012, 0.012, 0.013),  # black
        (0.045, 0.048, 0.052),  # anthracite
        (0.12, 0.125, 0.13),  # mid grey
        (0.23, 0.235, 0.24),  # light grey
        (0.43, 0.44, 0.45),  # silver
        (0.55, 0.535, 0.495),  # pearl
        (0.010, 0.020, 0.055),  # night blue
        (0.018, 0.060, 0.190),  # blue
        (0.110, 0.190, 0.270),  # steel blue
        (0.300, 0.013, 0.012),  # red
        (0.110, 0.008, 0.012),  # wine
        (0.012, 0.045, 0.025),  # racing green
        (0.130, 0.085, 0.050),  # bronze
        (0.330, 0.280, 0.205),  # sand
        (0.500, 0.120, 0.015),  # orange
    ),
    (22.0, 17, 10, 11, 6, 8, 3, 5, 5, 2, 4, 1.5, 2, 1.5, 1, 1),
)
"""Passenger cars and two-wheelers: 77 % achromatic."""

SOBER = Palette(
    EUROPEAN.colours,
    (48.0, 2, 5, 6, 6, 10, 3, 4, 6, 2, 5, 1, 2, 0, 0, 0),
)
"""Buses, trucks, vans, trains and whatever else."""

CLOTHES = Palette(
    (
        (0.020, 0.021, 0.025),  # black
        (0.055, 0.057, 0.062),  # charcoal
        (0.150, 0.150, 0.155),  # grey
        (0.560, 0.550, 0.530),  # off-white
        (0.018, 0.028, 0.065),  # navy
        (0.050, 0.085, 0.160),  # denim
        (0.140, 0.215, 0.330),  # light denim
        (0.270, 0.205, 0.135),  # camel
        (0.075, 0.080, 0.040),  # olive
        (0.030, 0.085, 0.055),  # bottle green
        (0.115, 0.015, 0.022),  # burgundy
        (0.310, 0.030, 0.025),  # red
        (0.400, 0.250, 0.035),  # mustard
        (0.330, 0.155, 0.170),  # rose
        (0.090, 0.050, 0.035),  # brown
        (0.200, 0.120, 0.240),  # lilac
    ),
    (14.0, 10, 10, 9, 13, 12, 6, 6, 5, 2, 3, 3, 2, 2, 2, 1),
)
"""Coats of people on foot."""

SUMO_YELLOW: Colour = (0.8, 0.8, 0.02)
"""What SUMO's GUI paints a vehicle without a colour, as a reflectance that paint can have."""

_COLOURFUL_CLASSES = frozenset(["passenger", "motorcycle", "moped", "bicycle", "scooter"])


def paint_of(
    vclass: str, kind: VehicleType, *, key: str, colours: str | Sequence[str], seed: int
) -> Colour:
    """The colour of a road user.

    Args:
        vclass: What it is drawn as.
        kind: Its vType.
        key: Its trajectory's key.
        colours: `european`, `sumo` (the vType's own), or a list of `#rrggbb`.
        seed: The job's.

    Raises:
        ConfigError: If a colour is not written `#rrggbb`.
    """
    if colours == "sumo":
        return reflectance(kind.colour) if kind.colour else SUMO_YELLOW
    if vclass == "pedestrian":
        return CLOTHES.draw(seed, key)
    if not isinstance(colours, str):
        return own_palette(colours).draw(seed, key)
    return (EUROPEAN if vclass in _COLOURFUL_CLASSES else SOBER).draw(seed, key)


def own_palette(colours: Sequence[str]) -> Palette:
    """A palette of the user's own, each colour as likely as the next.

    Raises:
        ConfigError: If the list is empty or a colour is not written `#rrggbb`.
    """
    if not colours:
        raise ConfigError("the list of colours is empty", key="vehicles.colours")
    try:
        found = tuple(reflectance(colour_of(colour)) for colour in colours)
    except ConfigError as error:
        raise ConfigError(str(error), key="vehicles.colours") from None
    return Palette(found, (1.0,) * len(found))


def reflectance(colour: Colour) -> Colour:
    """The nearest colour that a surface can have."""
    red, green, blue = (min(max(float(channel), 0.01), 0.8) for channel in colour)
    return red, green, blue
