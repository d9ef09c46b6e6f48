"""The letters on vehicles' number plates, as movers of their own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from sumo3dviz_pt.library.vehicles.plates import LETTER, Plate, letter_phase, plate_text
from sumo3dviz_pt.model.scene import Mover


def letters_on(body: Mover, plates: Sequence[Plate]) -> Iterator[Mover]:
    """Yield the letters on the plates of a body.

    Args:
        body: A road user, or a unit of it, at its place.
        plates: In the body's frame.
    """
    text = plate_text(body.id)
    for number, plate in enumerate(plates):
        for place, (character, at) in enumerate(zip(text, plate.letters(), strict=True)):
            yield replace(
                body,
                prototype=LETTER,
                part=f"{body.part}plate{number}letter{place}",
                world_from_body=body.world_from_body @ at,
                phase=letter_phase(character),
                effort=1.0,
            )
