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
from sumo3dviz_pt.library.materials import colour_of
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
        """Return the colour of a road user: the same for the same seed and key."""
        return self.colours[pick(self.shares, share_of(seed, key, "colour"))]


# fmt: off
_PAINTS = (
    # colour                 cars   others
    ((0.620, 0.630, 0.625),  22.0,  48.0),  # white
    ((0.012, 0.012, 0.013),  17.0,   2.0),  # black
    ((0.045, 0.048, 0.052),  10.0,   5.0),  # anthracite
    ((0.120, 0.125, 0.130),  11.0,   6.0),  # mid grey
    ((0.230, 0.235, 0.240),   6.0,   6.0),  # light grey
    ((0.430, 0.440, 0.450),   8.0,  10.0),  # silver
    ((0.550, 0.535, 0.495),   3.0,   3.0),  # pearl
    ((0.010, 0.020, 0.055),   5.0,   4.0),  # night blue
    ((0.018, 0.060, 0.190),   5.0,   6.0),  # blue
    ((0.110, 0.190, 0.270),   2.0,   2.0),  # steel blue
    ((0.300, 0.013, 0.012),   4.0,   5.0),  # red
    ((0.110, 0.008, 0.012),   1.5,   1.0),  # wine
    ((0.012, 0.045, 0.025),   2.0,   2.0),  # racing green
    ((0.130, 0.085, 0.050),   1.5,   0.0),  # bronze
    ((0.330, 0.280, 0.205),   1.0,   0.0),  # sand
    ((0.500, 0.120, 0.015),   1.0,   0.0),  # orange
)
"""Colours of vehicles, and how common they are: among cars and two-wheelers, and others."""

_COATS = (
    # colour                 people
    ((0.020, 0.021, 0.025),  14.0),  # black
    ((0.055, 0.057, 0.062),  10.0),  # charcoal
    ((0.150, 0.150, 0.155),  10.0),  # grey
    ((0.560, 0.550, 0.530),   9.0),  # off-white
    ((0.018, 0.028, 0.065),  13.0),  # navy
    ((0.050, 0.085, 0.160),  12.0),  # denim
    ((0.140, 0.215, 0.330),   6.0),  # light denim
    ((0.270, 0.205, 0.135),   6.0),  # camel
    ((0.075, 0.080, 0.040),   5.0),  # olive
    ((0.030, 0.085, 0.055),   2.0),  # bottle green
    ((0.115, 0.015, 0.022),   3.0),  # burgundy
    ((0.310, 0.030, 0.025),   3.0),  # red
    ((0.400, 0.250, 0.035),   2.0),  # mustard
    ((0.330, 0.155, 0.170),   2.0),  # rose
    ((0.090, 0.050, 0.035),   2.0),  # brown
    ((0.200, 0.120, 0.240),   1.0),  # lilac
)
"""Colours of coats, and how common they are."""
# fmt: on

EUROPEAN = Palette(tuple(row[0] for row in _PAINTS), tuple(row[1] for row in _PAINTS))
"""Passenger cars and two-wheelers: 77 % achromatic."""

SOBER = Palette(tuple(row[0] for row in _PAINTS), tuple(row[2] for row in _PAINTS))
"""Buses, trucks, vans, trains and all other vehicles."""

CLOTHES = Palette(tuple(row[0] for row in _COATS), tuple(row[1] for row in _COATS))
"""Coats of people on foot."""

ARMY = Palette(
    ((0.060, 0.068, 0.036), (0.048, 0.060, 0.034), (0.230, 0.185, 0.115)), (5.0, 3.0, 1.0)
)
"""Military vehicles: olive, bronze green, sand."""

SUMO_YELLOW: Colour = (0.8, 0.8, 0.02)
"""What SUMO's GUI paints a vehicle without a colour, as a reflectance that paint can have."""

_COLOURFUL_CLASSES = frozenset(
    ["passenger", "motorcycle", "moped", "bicycle", "scooter", "rickshaw", "wheelchair"]
)


def paint_of(
    vclass: str, kind: VehicleType, *, key: str, colours: str | Sequence[str], seed: int
) -> Colour:
    """Return the colour of a road user.

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
    if kind.vclass == "army":
        return ARMY.draw(seed, key)
    return (EUROPEAN if vclass in _COLOURFUL_CLASSES else SOBER).draw(seed, key)


def own_palette(colours: Sequence[str]) -> Palette:
    """Return a palette of the user's own, each colour as likely as the next.

    Raises:
        ConfigError: If the list is empty or a colour is not written `#rrggbb`.
    """
    if not colours:
        raise ConfigError("the list of colours is empty", key="vehicles.colours")
    try:
        tints = tuple(reflectance(colour_of(colour)) for colour in colours)
    except ConfigError as error:
        raise ConfigError(str(error), key="vehicles.colours") from None
    return Palette(tints, (1.0,) * len(tints))


def reflectance(colour: Colour) -> Colour:
    """Return the nearest colour that a surface can have."""
    red, green, blue = (min(max(float(channel), 0.01), 0.8) for channel in colour)
    return red, green, blue
