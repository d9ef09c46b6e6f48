"""What is kept of a world: made once, the same again, and never too much."""

import numpy as np

from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.world.memory import Memory


def counted():
    made = []
    return made, lambda name: made.append(name) or np.zeros(1000)


def test_a_thing_is_made_once():
    memory, (made, make) = Memory(), counted()
    first = memory.of(("house", 1), lambda: make("one"))
    assert memory.of(("house", 1), lambda: make("again")) is first
    assert memory.of(("house", 2), lambda: make("two")) is not first
    assert made == ["one", "two"]


def test_nothing_that_was_made_of_nothing_is_made_again():
    memory, made = Memory(), []
    for _ in range(2):
        assert memory.of(("empty",), lambda: made.append(1)) is None
    assert made == [1]


def test_what_was_asked_for_longest_ago_goes_first():
    memory, (made, make) = Memory(most=20_000), counted()
    for name in ("a", "b", "a", "c", "a", "b"):
        memory.of((name,), lambda name=name: make(name))
    # Two of 8 kB find room: c took the place of b, and a was asked for again before.
    assert made == ["a", "b", "c", "b"]


def test_a_thing_larger_than_all_room_is_handed_out_nevertheless():
    memory, (_, make) = Memory(most=10), counted()
    assert len(memory.of(("big",), lambda: make("big"))) == 1000


def test_arrays_are_weighed_wherever_they_are():
    memory, made = Memory(most=50_000), []

    def mesh(name):
        made.append(name)
        return [{"part": (Mesh(np.zeros((1000, 3)), np.zeros((500, 3), np.int64)),)}]

    for name in ("a", "b", "a"):
        memory.of((name,), lambda name=name: mesh(name))
    assert made == ["a", "b", "a"], "36 kB each: only one finds room"
