"""Words that are written on shops and signs, by language, from `assets/shop_words`.

The time zone in which a network lies tells its country, and so its language; zones that no
language lists speak English. Where people of a country speak several, one stands for all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_family

ENGLISH = "english"
"""The language of places that are not known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShopWords(RecipeValue):
    """What is written in a language.

    Attributes:
        zones: Time zones of the places where it is spoken, by their names in the tz database.
        shops: Words for shops of a few metres, as in the middle of a sentence's beginning.
        large: Words for one board along a whole front.
        towards: Where roads lead that have no names.
        leaving: What is written at an exit.
    """

    zones: tuple[str, ...]
    shops: tuple[str, ...]
    large: tuple[str, ...]
    towards: tuple[str, ...]
    leaving: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _WordsFile(AssetFile):
    """Content of an `asset.yaml` with words."""

    kind: Literal["shop_words"]
    recipe: ShopWords


LANGUAGES: Mapping[str, ShopWords] = {
    name: file.recipe for name, file in read_family("shop_words", _WordsFile).items()
}
"""The words of every language by its name."""


@dataclass(frozen=True, slots=True)
class Writing:
    """What decides what is written on a building.

    Attributes:
        language: One of `LANGUAGES`.
        seed: Of the choice of words and of how they are written.
    """

    language: str = ENGLISH
    seed: int = 0

    @property
    def words(self) -> ShopWords:
        """The words of its language."""
        return LANGUAGES[self.language]

    def dice(self, *numbers: int) -> np.random.Generator:
        """Return random numbers for one wall, or one of its uses."""
        return np.random.default_rng([self.seed, *numbers])


UNTOLD = Writing()
"""Of buildings whose place and name do not matter."""


def language_in(zone: str) -> str:
    """Return the language of a time zone by its name; English where none lists it."""
    spoken = (name for name, words in LANGUAGES.items() if zone in words.zones)
    return next(spoken, ENGLISH)
