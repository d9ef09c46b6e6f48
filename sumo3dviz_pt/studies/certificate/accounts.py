"""Compares the accounts of two films: frames, times, cameras, road users, signals, development."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from types import MappingProxyType
from typing import Any

import numpy as np

from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.pipeline.provenance import differences
from sumo3dviz_pt.studies.certificate.acts import Acts, key_of, swaps_log

Account = Mapping[str, Any]

_FEW = 3
"""Most road users that a sentence names."""

_DEVELOPED: Mapping[str, str] = MappingProxyType(
    {
        "exposure": "exposure [EV]",
        "tone": "tone curve",
        "glare": "glare",
        "response": "camera's response",
        "optics": "vignetting and grain",
        "metering": "metering",
    }
)
_TOLD_ELSEWHERE = (
    *("exposure", "output.exposure", "output.tone", "output.glare", "output.response"),
    *("frames that", "shot: frames"),
    *("sky, sun or air", "roads, houses", "the shot shows"),
)
"""Differences that other checks here say in better words, or that layers show."""

_PRESETS = "scene_templates/"
_CONFIGURED = ("scenario.sumocfg", "scenario.folder", "scenario: ")
_OF_SIMULATIONS = (".xml", ".xml.gz", ".sumocfg")
"""Inputs that are presets; settings that name a whole simulation, and how its files end."""

_KNOWN = frozenset(
    {
        *("film", "key", "command", "digest", "files", "delivered"),  # names and digests of a film
        *("left_out", "plan", "pilot", "spp", "quality", "shot"),  # follow from what is compared
        *("scene", "preset", "inputs", "companions", "versions", "package", "camera", "variant"),
        *("frames", "frame_rate", "fps", "size", "shutter", "road_users", "signal_changes"),
        *("world", "light", "overlays", "devices", "sound", *_DEVELOPED),
    }
)
"""What an account says and other checks here compare, or what follows from that."""


def account_faults(one: Account, other: Account, acts: Acts, planned: Sequence[str]) -> list[str]:
    """Return what differs in the accounts of two films and should not, a sentence each.

    Args:
        one: The first film's.
        other: The second's.
        acts: Where their factor acts.
        planned: What should differ in their scenes, as in `StimulusPair.changed`.
    """
    checks: tuple[Callable[[Account, Account, Acts], Iterator[str]], ...] = (
        *(_lengths, _times, _cameras, _shutters, _presence, _bodies, _motion, _lamps, _signals),
        *(_development, _digests, _weather, _drawn_over, _heard, _traced),
    )
    faults = [fault for check in checks for fault in check(one, other, acts)]
    return faults + list(_settings(one, other, acts, planned))


def named_differences(one: Account, other: Account, acts: Acts) -> list[str]:
    """Return what belongs to a level beside what it is about, such as the exposure of a night."""
    if not acts.develops:
        return []
    return [
        f"{word}: {_short(one.get(key))} and {_short(other.get(key))}"
        for key, word in _DEVELOPED.items()
        if one.get(key) != other.get(key)
    ]


def moving_otherwise(one: Account, other: Account, acts: Acts, planned: Sequence[str]) -> str:
    """Return how many road users differ where a factor may change all traffic; or nothing.

    Args:
        one: The first film's.
        other: The second's.
        acts: Where their factor acts.
        planned: What should differ in their scenes, as in `StimulusPair.changed`.
    """
    if not acts.motion:
        return ""
    first, second = one["road_users"], other["road_users"]
    every, single = first.keys() | second.keys(), first.keys() ^ second.keys()
    moved = sum(_rides(a) != _rides(b) for _, a, b in _users(one, other))
    why = "change the whole traffic log" if swaps_log(planned) else "may change all traffic"
    return (
        f"its levels {why}, so everything that moves may differ: of {len(every)} road users that"
        f" these films show, {len(single)} {'is' if len(single) == 1 else 'are'} in one of them"
        f" only and {moved} of the others {'moves' if moved == 1 else 'move'} otherwise; what is"
        " proven is proven of the rest of the picture alone"
    )


def _rides(user: Account) -> tuple[Any, Any]:
    """Return what says how a road user moves, and in which frames it is there."""
    return user["motion"], user["frames"]


def _lengths(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that films are not equally long."""
    del acts
    first, second = len(one["frames"]), len(other["frames"])
    if first != second:
        yield f"the films have {first} and {second} frames"
    for key, word in (("size", "size [px]"), ("frame_rate", "frames per second")):
        if one.get(key) != other.get(key):
            yield f"the films differ in {word}: {one.get(key)} and {other.get(key)}"


def _times(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that frames show other times."""
    pairs = _frames(one, other)
    unlike = [n for n, (a, b) in enumerate(pairs) if abs(a["time"] - b["time"]) > 1e-9]
    if unlike and not (acts.motion or acts.anything):
        a, b = pairs[unlike[0]]
        yield (
            f"frame {unlike[0]} shows {a['time']:g} s in one film and {b['time']:g} s in the other"
        )


def _cameras(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that frames are seen from elsewhere, or with another lens."""
    if acts.moves:
        return
    pairs = [(a["camera"], b["camera"]) for a, b in _frames(one, other)]
    unlike = [n for n, (a, b) in enumerate(pairs) if a != b]
    if not unlike:
        return
    a, b = pairs[unlike[0]]
    apart = float(np.linalg.norm(np.subtract(a["position"], b["position"])))
    cosine = float(np.clip(np.dot(a["forward"], b["forward"]), -1.0, 1.0))
    lens = "" if a["fov"] == b["fov"] else f", with lenses of {a['fov']:g} and {b['fov']:g} deg"
    if a.get("lens") != b.get("lens"):
        lens = f", with lenses {_lens(a)} and {_lens(b)}"
    yield (
        f"the camera is another in {counted(len(unlike), 'frame')}, in frame {unlike[0]} by"
        f" {100 * apart:.3g} cm and {np.degrees(np.arccos(cosine)):.3g} deg{lens}"
    )


def _lens(camera: Account) -> str:
    """Return what is said of a lens beside its angle, in words."""
    lens = camera.get("lens", {})
    return ", ".join(f"{name} {_short(value)}" for name, value in lens.items()) or "of a pinhole"


def _shutters(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that frames are exposed for other times."""
    first, second = one.get("shutter"), other.get("shutter")
    if first != second and not acts.moves:
        words = [_shutter(shutter) for shutter in (first, second)]
        yield f"the shutter is {words[0]} in one film and {words[1]} in the other"


def _shutter(shutter: Account | None) -> str:
    """Return what a shutter does, in words."""
    if shutter is None:
        return "an instant"
    rolling = float(shutter.get("rolling", 0.0))
    rows = f", rolling for {rolling:.3g} s" if rolling else ""
    return f"open for {float(shutter.get('open', 0.0)):.3g} s{rows}"


def _presence(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that road users are missing."""
    for number, (a, b) in enumerate(_frames(one, other)):
        lost = [key for key in sorted({*a["drawn"]} ^ {*b["drawn"]}) if not acts.may_reshape(key)]
        if lost:
            yield f"from frame {number} on only one film shows {_some(lost)}"
            return


def _bodies(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that road users look otherwise."""
    for what, may in (("body", acts.may_reshape), ("colour", acts.may_look)):
        unlike = [key for key, a, b in _users(one, other) if a[what] != b[what] and not may(key)]
        if unlike:
            yield f"another {what}: {_some(unlike)}"


def _motion(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that road users are elsewhere."""
    unlike = [
        key
        for key, a, b in _users(one, other)
        if _rides(a) != _rides(b) and not acts.may_reshape(key)
    ]
    if unlike:
        first = next(
            (n for n, (a, b) in enumerate(_frames(one, other)) if a["placed"] != b["placed"]), 0
        )
        yield f"from frame {first} on road users are elsewhere: {_some(unlike)}"


def _lamps(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that lamps of road users are lit otherwise."""
    if acts.light:
        return
    unlike = [
        key
        for key, a, b in _users(one, other)
        if a["lamps"] != b["lamps"] and not acts.may_reshape(key)
    ]
    if unlike:
        yield f"lamps are lit otherwise: {_some(unlike)}"


def _signals(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that traffic lights change otherwise."""
    if acts.motion or acts.anything:
        return
    first, second = ({_change(each) for each in film["signal_changes"]} for film in (one, other))
    apart = sorted(first ^ second)
    if apart:
        number, tls, state = apart[0]
        which = "the first" if apart[0] in first else "the second"
        yield f"traffic light {tls} goes to {state} at frame {number} in {which} film only"


def _development(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that films are developed otherwise."""
    if acts.develops:
        return
    for key, word in _DEVELOPED.items():
        a, b = one.get(key), other.get(key)
        if a != b:
            yield f"{word} is {_short(a)} in one film and {_short(b)} in the other"


def _digests(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that what was built differs though nothing should, in view or not."""
    if one.get("world") != other.get("world") and not acts.on_world:
        yield "roads, houses, plants, lamps or their materials are others"
    if one.get("light") != other.get("light") and not (acts.light or acts.anything):
        yield "sky, sun or air are others"


def _weather(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that frames have another weather."""
    pairs = _frames(one, other)
    unlike = [n for n, (a, b) in enumerate(pairs) if a.get("weather") != b.get("weather")]
    if unlike and not (acts.light or acts.anything):
        yield f"the weather is another in {counted(len(unlike), 'frame')}, the first is {unlike[0]}"


def _drawn_over(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that overlays put other pictures before or after a film, or that only one has any."""
    first, second = (
        {key: value for key, value in (film.get("overlays") or {}).items() if key != "files"}
        for film in (one, other)
    )
    if first != second and not (acts.overlays or acts.anything):
        yield "overlays are others: " + " and ".join(_overlays(drawn) for drawn in (first, second))


def _heard(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that films sound otherwise though who drives, where and in which rain is the same."""
    first, second = (
        {key: value for key, value in (film.get("sound") or {}).items() if key != "file"}
        for film in (one, other)
    )
    raining = any(a.get("weather") != b.get("weather") for a, b in _frames(one, other))
    asked = [film.get("scene", {}).get("output", {}).get("sound") for film in (one, other)]
    may = acts.motion or acts.moves or bool(acts.things) or raining or asked[0] != asked[1]
    if first != second and not may:
        levels = [each.get("levels", {}).get("LAeq") for each in (first, second)]
        yield f"they sound otherwise: LAeq is {levels[0]} in one film and {levels[1]} in the other"


def _traced(one: Account, other: Account, acts: Acts) -> Iterator[str]:
    """Yield that a film mixes frames of several devices, whose pixels differ a little."""
    del acts
    for film in (one, other):
        if devices := film.get("devices"):
            yield f"{film.get('film')} mixes frames of several devices: {' and '.join(devices)}"


def _overlays(drawn: Account) -> str:
    """Return what an account says of overlays, in words."""
    if not drawn:
        return "none"
    return ", ".join(f"{value} {key.replace('_', ' ')}" for key, value in drawn.items())


def _same_thing(one: Account, other: Account, planned: Collection[str]) -> Iterator[str]:
    """Yield what else an account says, and no check knows: it should be the same."""
    for key in sorted((one.keys() | other.keys()) - _KNOWN - {*planned}):
        first, second = one.get(key), other.get(key)
        if first != second:
            yield f"no level changes this: {key}: {_short(first)} -> {_short(second)}"


def _settings(one: Account, other: Account, acts: Acts, planned: Sequence[str]) -> Iterator[str]:
    """Yield settings, files and versions that differ though no level changes them."""
    keys, files = {key_of(change) for change in planned}, _planned_files(one, other, planned)
    for difference in differences(one, other):
        key = key_of(difference)
        if key in keys or difference.startswith(_TOLD_ELSEWHERE):
            continue
        if key.startswith("input ") and key.removeprefix("input ") in files:
            continue
        if key in ("camera", "shot: from") and (acts.moves or acts.motion):
            continue
        yield f"no level changes this: {difference}"
    yield from _same_thing(one, other, keys)


def _planned_files(one: Account, other: Account, planned: Sequence[str]) -> frozenset[str]:
    """Return the inputs that levels change: files and presets that they name, and what these need.

    A level that names a configuration of the simulation changes any file of the simulation.
    """
    inputs = {*one["inputs"], *other["inputs"]} if "inputs" in one and "inputs" in other else set()
    named = {word for change in planned for word in _names_in(change.partition(": ")[2])}
    files = {name for name in inputs if {name, PurePosixPath(name).name} & named}
    files |= {name for name in inputs if name.startswith(_PRESETS) and _stem(name) in named}
    for account in (one, other):
        for name, needed in (account.get("companions") or {}).items():
            files |= set(needed) if {name, PurePosixPath(name).name} & named else set()
    if any(key_of(change).startswith(_CONFIGURED) for change in planned):
        files |= {name for name in inputs if name.endswith(_OF_SIMULATIONS)}
    return frozenset(files)


def _names_in(change: str) -> Iterator[str]:
    """Yield words that a change holds, whole and as the last part of a path."""
    for word in re.split(r" -> |[\[\]\",]+ ?", change):
        yield word
        yield PurePosixPath(word).name


def _stem(name: str) -> str:
    """Return what a preset's file is called, as scene files name it."""
    return PurePosixPath(name).name.removesuffix(".yaml")


def _frames(one: Account, other: Account) -> list[tuple[Account, Account]]:
    """Return the frames that both films have."""
    return list(zip(one["frames"], other["frames"], strict=False))


def _users(one: Account, other: Account) -> Iterator[tuple[str, Account, Account]]:
    """Yield the road users that both films show."""
    first, second = one["road_users"], other["road_users"]
    for key in sorted(first.keys() & second.keys()):
        yield key, first[key], second[key]


def _change(change: Account) -> tuple[int, str, str]:
    """Return a change of a traffic light without its time, which is its frame's."""
    return int(change["frame"]), str(change["tls"]), str(change["state"])


def _short(value: Any) -> str:
    """Return a number with three decimals at most, or a word."""
    return f"{value:.3f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def _some(keys: Sequence[str]) -> str:
    """Return road users in words."""
    more = len(keys) - _FEW
    return ", ".join(keys[:_FEW]) + (f" and {more} more" if more > 0 else "")
