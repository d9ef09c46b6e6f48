"""Smoothers: each makes continuous motion of the front of a road user.

A new smoother is one new module of this folder that registers itself.
"""

from __future__ import annotations

import pkgutil
from importlib import import_module

for _module in pkgutil.iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
