"""Two writers take the same pictures, and neither outlives the other's failure."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.pipeline.films.overlays import write_both


def pictures(count):
    for number in range(count):
        yield np.full((2, 3, 3), number, dtype=np.float32)


def keeper(found):
    return lambda some: found.extend(float(picture[0, 0, 0]) for picture in some)


def test_both_take_all_pictures_in_order():
    one, other = [], []
    write_both(pictures(40), keeper(one), keeper(other))
    assert one == other == [float(number) for number in range(40)]


def test_a_failure_of_the_second_stops_the_first():
    taken = []

    def fails(some):
        next(iter(some))
        raise ValueError("no room")

    with pytest.raises(ValueError, match="no room"):
        write_both(pictures(1000), keeper(taken), fails)
    assert len(taken) < 10


def test_a_failure_of_the_first_reaches_the_second_as_an_error():
    seen = []

    def first(some):
        next(iter(some))
        raise OSError("full")

    def second(some):
        try:
            for _ in some:
                pass
        except RenderError as error:
            seen.append(str(error))
            raise

    with pytest.raises(OSError, match="full"):
        write_both(pictures(100), first, second)
    assert seen == ["the film beside it failed"]


def test_a_failure_of_the_pictures_themselves_is_told():
    def broken():
        yield from pictures(2)
        raise ValueError("damaged")

    with pytest.raises(ValueError, match="damaged"):
        write_both(broken(), keeper([]), keeper([]))
