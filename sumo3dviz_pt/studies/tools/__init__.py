"""The files of tools that show films to people and record their answers.

The writer of a new tool is a function of a module of this folder that `writes` enters, beside the
tool's name in `job/study.py`.
"""

from __future__ import annotations

import pkgutil
from importlib import import_module

for _module in pkgutil.iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
