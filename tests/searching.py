"""How many examples a law is tried with: few and always the same, or many at random."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

_MORE = 4
"""How many times more examples a random search tries."""

_USUAL = 50
"""How often a law is tried that does not say it itself."""

_SLOW = [HealthCheck.too_slow]  # says how fast a machine is, not whether a law holds

settings.register_profile(
    "same",
    max_examples=_USUAL,
    derandomize=True,
    deadline=None,
    suppress_health_check=_SLOW,
    print_blob=True,
)
settings.register_profile(
    "search",
    derandomize=False,  # which is the default where CI is set
    database=None,  # so that a seed gives the same examples everywhere
    max_examples=_USUAL * _MORE,
    deadline=None,
    suppress_health_check=_SLOW,
    print_blob=True,
)
settings.load_profile("same")  # `--hypothesis-profile=search` loads the other one instead


def tries(usual: int) -> int:
    """Examples of a law that says itself how often it is tried, as the profile has it.

    Args:
        usual: How many are always tried.
    """
    return usual if settings.default.derandomize else _MORE * usual
