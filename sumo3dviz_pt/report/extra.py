"""Says early what reports need beyond the package itself."""

from __future__ import annotations

from importlib.util import find_spec

from sumo3dviz_pt.errors import ConfigError

_NEEDED = {"flip_evaluator": "flip-evaluator", "matplotlib": "matplotlib"}


def check_extra() -> None:
    """Refuse to start work whose results could not be measured or drawn.

    Raises:
        ConfigError: If a package of the extra `report` is missing.
    """
    missing = [package for module, package in _NEEDED.items() if find_spec(module) is None]
    if missing:
        raise ConfigError(
            f'reports need {" and ".join(missing)}: pip install "sumo3dviz_pt[report]"'
        )
