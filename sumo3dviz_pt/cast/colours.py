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
    ((0.020, 0.021, 0.025),  13.0),  # black
    ((0.052, 0.054, 0.060),   8.0),  # charcoal
    ((0.018, 0.028, 0.065),   8.0),  # navy
    ((0.062, 0.060, 0.038),   6.0),  # dark olive
    ((0.660, 0.655, 0.640),   8.0),  # white
    ((0.540, 0.500, 0.430),   6.0),  # cream
    ((0.400, 0.320, 0.230),   6.0),  # beige
    ((0.330, 0.332, 0.340),   5.0),  # pale grey
    ((0.046, 0.084, 0.165),   7.0),  # denim
    ((0.150, 0.230, 0.350),   6.0),  # light denim
    ((0.360, 0.450, 0.570),   4.0),  # pale blue
    ((0.024, 0.075, 0.270),   3.0),  # royal blue
    ((0.360, 0.030, 0.027),   6.0),  # red
    ((0.028, 0.125, 0.068),   5.0),  # green
    ((0.450, 0.265, 0.040),   5.0),  # mustard
    ((0.430, 0.190, 0.205),   4.0),  # rose
)
"""Colours of coats, shirts and sweaters, and how common they are: a third is dark, a quarter pale,
a fifth blue and a fifth bright."""
# fmt: on

CLOTHES = Palette(tuple(row[0] for row in _COATS), tuple(row[1] for row in _COATS))
"""What people wear on their trunks, on foot and in the saddle."""

ARMY = Palette(
    ((0.060, 0.068, 0.036), (0.048, 0.060, 0.034), (0.230, 0.185, 0.115)), (5.0, 3.0, 1.0)
)
"""Military vehicles: olive, bronze green, sand."""

SUMO_YELLOW: Colour = (0.8, 0.8, 0.02)
"""What SUMO's GUI paints a vehicle without a colour, as a reflectance that paint can have."""

_COLOURFUL_CLASSES = frozenset(["passenger", "motorcycle", "moped", "rickshaw"])

_RIDDEN_BARE = frozenset(["bicycle", "scooter", "wheelchair"])
"""Classes of which only the rider's clothes take the colour of a road user."""


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
    if vclass in _RIDDEN_BARE:
        return CLOTHES.draw(seed, key)
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
