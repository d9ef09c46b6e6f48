"""Says how the cases of `check --stress` ended, as values and in words."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

MUCH_CAPPED = 0.02
"""Share of the energy from which the report says what the firefly cap took."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a case ended.

    Attributes:
        name: The case's.
        verdict: `ok`, `failed` or `left out`.
        why: What is wrong, or why it is left out; empty if ok.
        cpu: CPU-seconds, building included.
        nonfinite: Pixels x passes that were NaN or Inf and were replaced.
        negative: Pixels x passes below zero that were replaced.
        capped: Share of the energy that the firefly cap took, [0, 1].
    """

    name: str
    verdict: str
    why: str = ""
    cpu: float = 0.0
    nonfinite: int = 0
    negative: int = 0
    capped: float = 0.0


@dataclass(frozen=True, slots=True)
class StressReport:
    """How all cases ended.

    Attributes:
        camera: Whose shot was put under stress.
        time: Of that shot [s].
        outcomes: One for each case, in the order of running.
    """

    camera: str
    time: float
    outcomes: tuple[Outcome, ...]

    def count(self, verdict: str) -> int:
        """Return how many cases ended like that."""
        return sum(outcome.verdict == verdict for outcome in self.outcomes)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it for JSON."""
        return asdict(self)


def in_words(report: StressReport) -> str:
    """Return the report as people read it."""
    width = max((len(outcome.name) for outcome in report.outcomes), default=0)
    lines = [f"shot {report.camera} at {report.time:.12g} s"]
    lines += [_line(outcome, width) for outcome in report.outcomes]
    spent = sum(outcome.cpu for outcome in report.outcomes)
    lines.append(
        f"{report.count('ok')} ok, {report.count('failed')} failed,"
        f" {report.count('left out')} left out, {spent:.0f} CPU-seconds"
    )
    return "\n".join(lines)


def _line(outcome: Outcome, width: int) -> str:
    """Return one case in a line."""
    words = f"{outcome.name:<{width}}  {outcome.verdict:<8}  {outcome.cpu:6.1f} CPU-s"
    notes = [outcome.why] if outcome.why else []
    if outcome.nonfinite:
        notes.append(f"{outcome.nonfinite} values were NaN or Inf")
    if outcome.negative:
        notes.append(f"{outcome.negative} values were negative")
    if outcome.capped > MUCH_CAPPED:
        notes.append(f"the firefly cap took {outcome.capped:.0%} of the energy")
    return f"{words}  {'; '.join(notes)}".rstrip()
