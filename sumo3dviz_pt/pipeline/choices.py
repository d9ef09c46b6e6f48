"""Lists the names that keys of the scene file take, for help, completion and editors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType

from sumo3dviz_pt import catalog


def _codecs() -> Sequence[str]:
    from sumo3dviz_pt.video.codecs import AUTO, CODECS

    return (AUTO, *CODECS)


def _tones() -> Sequence[str]:
    from sumo3dviz_pt.image.tonemap import tone_names

    return tone_names()


def _smoothers() -> Sequence[str]:
    from sumo3dviz_pt.motion import smoother_names

    return smoother_names()


def _vehicles(vclass: str = "") -> Sequence[str]:
    """Return the vehicles that can be drawn, of one vClass if given; no parts of vehicles."""
    found = []
    for name in catalog.names("vehicles"):
        classes = catalog.find("vehicles", name).meta.get("vclass", "passenger")
        classes = [classes] if isinstance(classes, str) else classes
        if vclass in classes or (classes and not vclass):
            found.append(name)
    return found


def _models() -> Sequence[str]:
    return (*_vehicles(), *catalog.names("people"))


def _vclasses() -> Sequence[str]:
    from sumo3dviz_pt.sumo.classes import CLASS_DEFAULTS

    return tuple(CLASS_DEFAULTS)


NAMES: Mapping[str, Callable[[], Sequence[str]]] = MappingProxyType(
    {
        "quality": partial(catalog.template_names, "quality"),
        "template": partial(catalog.template_names, "scene"),
        "sky.preset": partial(catalog.template_names, "sky"),
        "weather.preset": partial(catalog.template_names, "weather"),
        "cameras.NAME.view": partial(catalog.template_names, "camera"),
        "output.codec": _codecs,
        "output.tone": _tones,
        "motion.smoother": _smoothers,
        "ground.texture": partial(catalog.names, "surfaces"),
        "vehicles.types.NAME": _vclasses,
        "vehicles.passenger": partial(_vehicles, "passenger"),
        "vehicles.by_id.NAME.model": _models,
    }
)
"""Names by the key of the scene file that takes them."""


def names_for(key: str) -> tuple[str, ...]:
    """Return what a key of the scene file can be set to; nothing where that is no list of names."""
    return tuple(NAMES[key]()) if key in NAMES else ()
