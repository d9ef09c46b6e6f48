"""Says before any work what reports need beyond the package itself."""

from __future__ import annotations

from importlib.util import find_spec

from sumo3dviz_pt.errors import MissingExtraError

_NEEDED = {"flip_evaluator": "flip-evaluator", "matplotlib": "matplotlib"}


def check_extra(*modules: str) -> None:
    """Refuse to start work whose results could not be measured or drawn.

    Args:
        modules: Those that the work needs; none means all of the extra.

    Raises:
        MissingExtraError: If a package of the extra `report` is missing.
    """
    needed = {module: _NEEDED[module] for module in modules or _NEEDED}
    missing = [package for module, package in needed.items() if find_spec(module) is None]
    if missing:
        raise MissingExtraError(f"reports need {' and '.join(missing)}", extra="report")
