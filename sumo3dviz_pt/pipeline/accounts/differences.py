"""Says in words what differs between two accounts of what was rendered."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from sumo3dviz_pt.job.traffic import TrafficSettings
from sumo3dviz_pt.job.weather import WeatherSettings
from sumo3dviz_pt.pipeline.accounts.provenance import with_files

Account = Mapping[str, Any]

_SECTIONS: Mapping[str, str] = MappingProxyType(
    {
        "scene": "",
        "preset": "quality preset: ",
        "shot": "shot: ",
        "inputs": "input ",
        "versions": "version of ",
        "package": "our own ",
    }
)
"""Mappings in an account, and the words before their keys."""

_PLAIN = ("camera", "time", "exposure", "variant")
"""Single values in an account."""

_DIGESTS: Mapping[str, str] = MappingProxyType(
    {
        "world": "roads, houses, plants, lamps or their materials are others",
        "light": "sky, sun or air are others",
        "plan": "the shot shows other bodies, or has other room for them",
    }
)
_HASHED = frozenset({"inputs", "package"})
_NOT_SEEN = ("output.layers",)
"""Keys of a scene that act on no picture."""

_NO_PIXELS = ("shots", "template", "quality", "output.codec", "output.fps", "output.tone")
_NOT_STORED = (*_NOT_SEEN, *_NO_PIXELS, "output.glare", "scenario")
"""Keys of a scene that act on no stored frame, or whose effect another part of an account tells."""


def differences(one: Account, other: Account, *, stored: bool = False) -> list[str]:
    """Return what differs, from the first to the second; nothing for the same picture or film.

    Commands are not compared: another name of the output is another command.

    Args:
        one: The account of a picture, or of a film.
        other: The account of the other one.
        stored: Whether only that counts which tells frames of one film from those of another,
            and not how they are developed.
    """
    said = []
    for section, words in _SECTIONS.items():
        old, new = (
            dict(_leaves(_content(account, section, stored=stored))) for account in (one, other)
        )
        for key in sorted(old.keys() | new.keys()):
            left_out = section == "scene" and key.startswith(_NOT_STORED if stored else _NOT_SEEN)
            if old.get(key) != new.get(key) and not left_out:
                said.append(words + _changed(key, old, new, hashed=section in _HASHED))
    plain = [key for key in _PLAIN if not (stored and key == "time")]
    said += [_changed(key, one, other) for key in plain if one.get(key) != other.get(key)]
    said += [words for key, words in _DIGESTS.items() if one.get(key) != other.get(key)]
    return said + list(_frames(one.get("frames"), other.get("frames")))


def _content(account: Account, section: str, *, stored: bool) -> Account:
    """Return what an account says in a section.

    A scene without weather has the weather of one that leaves every key of it at its default, so
    that what a preset adds is told, and no season that both have; so it is with changed traffic.
    Stored frames are told apart by what stands in their scenes.
    """
    content: Account = account.get(section) or {}
    if section != "scene" or stored:
        return content
    plain = {"weather": WeatherSettings(), "traffic": TrafficSettings()}
    filled = {
        name: {**with_files(own.model_dump(by_alias=True), str), **(content.get(name) or {})}
        for name, own in plain.items()
    }
    return {**content, **filled}


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield values by dotted key; lists of numbers and words are values."""
    if isinstance(value, Mapping):
        pairs: Sequence[tuple[Any, Any]] = list(value.items())
    elif isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        pairs = list(enumerate(value))
    else:
        yield path, value
        return
    for key, item in pairs:
        yield from _leaves(item, f"{path}.{key}" if path else str(key))


def _changed(key: str, old: Account, new: Account, *, hashed: bool = False) -> str:
    """Return one value that differs."""
    if key not in old or key not in new:
        side = "second" if key not in old else "first"
        return f"{key}: only the {side} has it"
    if hashed:
        return f"{key}: other content"
    return f"{key}: {_shown(old[key])} -> {_shown(new[key])}"


def _shown(value: Any) -> str:
    """Return a value as people read it."""
    return value if isinstance(value, str) else json.dumps(value)


def _frames(old: Any, new: Any) -> Iterator[str]:
    """Yield what differs in the frames of two films."""
    if not (isinstance(old, list) and isinstance(new, list)):
        return
    pairs = list(zip(old, new, strict=False))
    for key, words in (
        ("time", "that show other times"),
        ("camera", "that are seen from elsewhere"),
        ("drawn", "that show others on the road"),
    ):
        unlike = [number for number, (a, b) in enumerate(pairs) if a.get(key) != b.get(key)]
        if unlike:
            yield f"frames {words}: {len(unlike)}, the first is {unlike[0]}"
