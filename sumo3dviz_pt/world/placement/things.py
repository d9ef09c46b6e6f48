"""Names of the things that faces of the world belong to; see `Mesh.things`.

A name depends on what a thing is and where it stands, never on cameras or chance, so it is the
same in all films of a place.
"""

from __future__ import annotations

from collections.abc import Iterable


def thing_of(name: str) -> str:
    """Return the name of the thing that an object's faces belong to, such as `tree:poi_7`.

    Args:
        name: Of the object: its kind, a colon, and its id.
    """
    kind, _, own = name.partition(":")
    return f"{kind.removesuffix('s')}:{own}"


def thing_at(kind: str, place: Iterable[float]) -> str:
    """Return the name of a thing that has no id: what it is, and where, to 0.1 m.

    Args:
        kind: What it is, such as `bench`.
        place: x, y, and maybe z, [m].
    """
    # Adding 0 makes -0 a 0.
    return f"{kind}:" + ",".join(f"{round(float(one), 1) + 0.0:.1f}" for one in place)
