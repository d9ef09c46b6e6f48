"""Mitsuba's variants by the names that users choose; importing them loads nothing."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from sumo3dviz_pt.errors import ConfigError

VARIANTS: Mapping[str, str] = MappingProxyType(
    {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb", "scalar": "scalar_rgb"}
)

VARIANT = "llvm"
"""The variant that is used unless another is chosen."""


def check_variant(name: str) -> None:
    """Refuse a name that no variant has.

    Raises:
        ConfigError: Suggests one.
    """
    if name not in VARIANTS:
        from sumo3dviz_pt.catalog import did_you_mean

        raise ConfigError(
            f"no variant is called {name!r}{did_you_mean(name, VARIANTS)}", key="variant"
        )
