"""Cameras: where the eye is and what it sees with, at any time.

A new mode is one new module of this folder that registers its builder, beside its settings
in `job/settings.py`.
"""

from __future__ import annotations

import pkgutil
from importlib import import_module

for _module in pkgutil.iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
