"""A colour that has a name is of that hue, wherever it stands: its channels are not mixed up.

Names are the keys of recipes and tables, and short comments beside rows. What is red, green or
blue at a glance needs no measurement: the order of the channels tells it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import pytest
from manual import ROOT

_NUMBER = r"(\d*\.\d+|\d)"
_TRIPLE = rf"[\[(]{_NUMBER}, *{_NUMBER}, *{_NUMBER}[\])]"
_NOTED = re.compile(_TRIPLE + r"[^#\n]*#([\w ,-]+)")
_CODE = re.compile(rf'^ *"?(\w+)"?(?:: Colour)?(?: =|:) *(?:\w+\([\d.e-]+, *)?{_TRIPLE}', re.M)
_RECIPE = re.compile(rf"^ *(?:- )?(\w+): \{{[^\n]*?\bcolour: {_TRIPLE}", re.M)
_SHORT = 3
"""Words of a comment that name the colour; what follows is said about it."""

_RGB = tuple[float, float, float]
_LAWS: Mapping[str, Callable[[float, float, float], bool]] = {
    "red brick salmon rose": lambda r, g, b: r > max(g, b),
    "wine burgundy": lambda r, g, b: r > b >= g,
    "blue navy denim": lambda r, g, b: r <= g < b,
    "racing bottle": lambda r, g, b: g > b > r,
    "green": lambda r, g, b: g > max(r, b),
    "olive": lambda r, g, b: b < min(r, g),
    "lilac": lambda r, g, b: g < r <= b,
    "yellow ochre sand cream ecru beige mustard": lambda r, g, b: r >= g > b,
    "sandstone camel caramel": lambda r, g, b: r > g > b,
    "orange amber bronze brown oak rust skin pearl": lambda r, g, b: r > g > b,
    "anthracite charcoal": lambda r, g, b: r <= g <= b <= 1.3 * r,
    "white black grey silver": lambda r, g, b: max(r, g, b) <= 1.25 * min(r, g, b) + 0.005,
}  # fmt: skip
_LAW_OF = {word: law for words, law in _LAWS.items() for word in words.split()}


class Named(NamedTuple):
    """A colour, what it is called, and where that is written."""

    place: str
    words: tuple[str, ...]
    rgb: _RGB


def named_colours(path: Path) -> Iterator[Named]:
    """Colours of a file whose names say a hue."""
    text = path.read_text(encoding="utf-8")
    forms = (_RECIPE, _NOTED) if path.suffix == ".yaml" else (_CODE, _NOTED)
    for form in forms:
        for found in form.finditer(text):
            *numbers, name = found.groups() if form is _NOTED else (*found.groups()[1:], found[1])
            spoken = re.findall("[a-z]+", name.lower())[:_SHORT]
            words = tuple(word for word in spoken if word in _LAW_OF)
            line = text.count("\n", 0, found.end()) + 1
            if words:
                red, green, blue = map(float, numbers)
                yield Named(f"{path.relative_to(ROOT)}:{line}", words, (red, green, blue))


COLOURS = [
    colour
    for folder, pattern in (("sumo3dviz_pt", "*.py"), ("assets", "asset.yaml"))
    for path in sorted((ROOT / folder).rglob(pattern))
    for colour in named_colours(path)
]


def suits(colour: Named) -> bool:
    """Whether a colour is of the hue that one of its words says ("blue grey" may be either)."""
    own = [word for word in colour.words if word in ("racing", "bottle")] or colour.words
    return any(_LAW_OF[word](*colour.rgb) for word in own)


def test_colours_have_the_hue_of_their_names() -> None:
    wrong = [f"{one.place}: {' '.join(one.words)} {one.rgb}" for one in COLOURS if not suits(one)]
    assert not wrong


@pytest.mark.parametrize(
    "file", ["cast/colours.py", "library/paints.py", "library/street/signs.py", "palettes"]
)
def test_the_law_sees_the_tables_of_colours(file: str) -> None:
    assert sum(file in colour.place for colour in COLOURS) >= 6
    assert len(COLOURS) > 150


def test_a_row_with_red_and_blue_swapped_is_found() -> None:
    """Of all rows that the eye could tell from what they are called."""
    vivid = [one for one in COLOURS if abs(one.rgb[0] - one.rgb[2]) > 0.25 * max(one.rgb)]
    swapped = [one._replace(rgb=one.rgb[::-1]) for one in vivid]
    missed = [one for one in swapped if suits(one)]
    assert len(vivid) > 80
    assert all(set(one.words) & {"green", "grey"} for one in missed)
