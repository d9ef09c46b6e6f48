"""Letters of five by seven dots, as destination signs and lorries show them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

_ROWS = 7

_DOTS: Mapping[str, str] = {
    # Seven rows of five dots from the top, each a number of two hexadecimal digits.
    "0": "0e11131519110e",
    "1": "040c040404040e",
    "2": "0e11010204081f",
    "3": "1f02040201110e",
    "4": "02060a121f0202",
    "5": "1f101e0101110e",
    "6": "0608101e11110e",
    "7": "1f010204080808",
    "8": "0e11110e11110e",
    "9": "0e11110f01020c",
    "A": "0e11111f111111",
    "B": "1e11111e11111e",
    "C": "0e11101010110e",
    "D": "1c12111111121c",
    "E": "1f10101e10101f",
    "F": "1f10101e101010",
    "G": "0e11101711110f",
    "H": "1111111f111111",
    "I": "0e04040404040e",
    "K": "11121418141211",
    "L": "1010101010101f",
    "M": "111b1515111111",
    "N": "11111915131111",
    "O": "0e11111111110e",
    "P": "1e11111e101010",
    "R": "1e11111e141211",
    "S": "0f10100e01011e",
    "T": "1f040404040404",
    "U": "1111111111110e",
    "V": "11111111110a04",
    "W": "11111115151b11",
    "X": "11110a040a1111",
    "Y": "11110a04040404",
    "Z": "1f01020408101f",
    "-": "0000001f000000",
    " ": "00000000000000",
}


class Run(NamedTuple):
    """Lit dots beside each other; between two letters a column is left free.

    Attributes:
        row: From the top.
        begin: Where it begins [columns].
        end: Where it ends [columns].
    """

    row: int
    begin: float
    end: float


class DotText(NamedTuple):
    """A text of dots.

    Attributes:
        runs: What is lit.
        columns: How many.
        rows: How many.
    """

    runs: list[Run]
    columns: int
    rows: int


def letter_runs(text: str) -> DotText:
    """Return the lit dots of a text.

    Args:
        text: Of known letters: digits, most capitals, space, hyphen.

    Raises:
        KeyError: If a letter is unknown.
    """
    runs: list[Run] = []
    for place, letter in enumerate(text):
        code = _DOTS[letter]
        for row in range(_ROWS):
            bits = int(code[2 * row : 2 * row + 2], 16)
            lit = [column for column in range(5) if bits >> (4 - column) & 1]
            runs += [
                Run(row, 6.0 * place + first, 6.0 * place + last + 1)
                for first, last in _stretches(lit)
            ]
    return DotText(runs, max(6 * len(text) - 1, 1), _ROWS)


def _stretches(lit: list[int]) -> list[tuple[int, int]]:
    """First and last of each unbroken stretch of numbers."""
    starts = [n for n in lit if n - 1 not in lit]
    ends = [n for n in lit if n + 1 not in lit]
    return list(zip(starts, ends, strict=True))
