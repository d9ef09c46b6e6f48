"""What is kept of a world: made once, the same again, and never too much."""

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.world.memory import Memory, digest_of


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


def test_what_was_used_longest_ago_goes_first():
    memory, (made, make) = Memory(most=20_000), counted()
    for name in ("a", "b", "a", "c", "a", "b"):
        memory.of((name,), lambda name=name: make(name))
    # Two of 8 kB find room: c took the place of b, and a was used again before.
    assert made == ["a", "b", "c", "b"]


def test_a_thing_larger_than_all_room_is_handed_out_nevertheless():
    memory, (_, make) = Memory(most=10), counted()
    assert len(memory.of(("big",), lambda: make("big"))) == 1000


def test_a_view_keeps_its_things_under_its_prefix():
    memory, (made, make) = Memory(), counted()
    north, south = memory.within("region", "north"), memory.within("region", "south")
    thing = north.of(("kerb", 1), lambda: make("north"))
    assert south.of(("kerb", 1), lambda: make("south")) is not thing
    assert memory.of(("kerb", 1), lambda: make("neither")) is not thing
    assert memory.of(("region", "north", "kerb", 1), lambda: make("again")) is thing
    assert memory.within("region").within("north").of(("kerb", 1), lambda: make("again")) is thing
    assert made == ["north", "south", "neither"]


def test_a_memory_and_its_views_share_their_room():
    memory, (made, make) = Memory(most=20_000), counted()
    for name in ("a", "b", "c"):
        memory.within(name).of(("thing",), lambda name=name: make(name))
    memory.of(("a", "thing"), lambda: make("a again"))
    assert made == ["a", "b", "c", "a again"], "two of 8 kB find room"


def test_arrays_are_weighed_wherever_they_are():
    memory, made = Memory(most=50_000), []

    def mesh(name):
        made.append(name)
        return [{"part": (Mesh(np.zeros((1000, 3)), np.zeros((500, 3), np.int64)),)}]

    for name in ("a", "b", "a"):
        memory.of((name,), lambda name=name: mesh(name))
    assert made == ["a", "b", "a"], "36 kB each: only one finds room"


def test_a_view_by_content_is_the_same_from_everywhere():
    memory, (made, make) = Memory(), counted()
    one, other = memory.within("roads", 1), memory.within("roads", 2)
    first = one.by_content.of(("piece", b"content"), lambda: make("one"))
    assert other.by_content.of(("piece", b"content"), lambda: make("again")) is first
    assert other.of(("piece", b"content"), lambda: make("other")) is not first
    assert made == ["one", "other"]


def test_digests_tell_contents_apart():
    square = shapely.box(0.0, 0.0, 1.0, 1.0)
    contents = [
        (square,),
        (shapely.box(0.0, 0.0, 1.0, 1.0 + 1e-15),),
        (np.zeros(2),),
        (np.zeros((2, 1)),),
        (np.zeros(2, dtype=np.float32),),
        ("ab", "c"),
        ("a", "bc"),
        ("abc",),
        (),
    ]
    assert len({digest_of(*content) for content in contents}) == len(contents)
    assert digest_of(square, "a") == digest_of(shapely.from_wkb(shapely.to_wkb(square)), "a")
