"""Colours of vehicles and clothes: seeded per id, always one of a palette."""

from __future__ import annotations

from collections.abc import Sequence

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials import colour_of
from sumo3dviz_pt.library.paints import EUROPEAN, SOBER, Palette
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.traffic import VehicleType

# fmt: off
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
