"""Settings that change recorded traffic: single rides, and how many there are."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from sumo3dviz_pt.job.quantities import Quantity
from sumo3dviz_pt.job.ranges import MOST_ENTRIES, Finite, Names, Seconds
from sumo3dviz_pt.job.values import Settings

MOST_DELAY = 120.0
"""Most by which a ride may be moved in time [s]; so much more of the log is read."""

_Delay = Annotated[float, Quantity("s", -MOST_DELAY, MOST_DELAY)]
_Gap = Annotated[float, Quantity("s", 0.0, 60.0)]


class RideEdit(Settings):
    """Another time or pace of a recorded ride, along the path that it took."""

    delay: _Delay | None = Field(
        None, description="how much later it comes by everywhere, such as 0.8 s; earlier below 0"
    )
    behind: str | None = Field(None, description="id of the road user that it follows")
    gap: _Gap | None = Field(
        None,
        description="time from the rear of `behind` to its own front, such as 1.5 s, where that"
        " rear is `at`",
    )
    at: Seconds | None = Field(None, description="SUMO's time at which the gap is kept [s]")
    moves: Literal["auto", "self", "behind"] = Field(
        "auto",
        description="who is moved in time for the gap: the ride itself, or `behind`, the one ahead;"
        " auto moves the one ahead where a camera rides with this one, so that its drive stays",
    )
    pace: Finite | None = Field(
        None, ge=0.5, le=2.0, description="factor of its speed; where it is at `around` it stays"
    )
    around: Seconds | None = Field(None, description="SUMO's time that `pace` leaves as it is [s]")

    @model_validator(mode="after")
    def _one_way(self) -> RideEdit:
        """Ask for a delay or a gap, and for all that a gap and a pace need."""
        gap = (self.behind, self.gap, self.at)
        if any(value is not None for value in gap) and None in gap:
            raise ValueError("a gap needs behind, gap and at")
        if self.gap is not None and self.delay is not None:
            raise ValueError("give either delay or gap")
        if self.gap is None and self.moves != "auto":
            raise ValueError("`moves` says who is moved for a gap: it needs behind, gap and at")
        if (self.pace is None) != (self.around is None):
            raise ValueError("a pace needs around, and around a pace")
        if self.gap is None and self.delay is None and self.pace is None:
            raise ValueError("give delay, gap or pace")
        return self


class TrafficSettings(Settings):
    """What is changed of the recorded traffic."""

    rides: dict[str, RideEdit] = Field(
        default_factory=dict, max_length=MOST_ENTRIES, description="other times or paces, by id"
    )
    leave_out: Names = Field((), description="ids of road users that are not shown; * and ?")
    share: Finite = Field(
        1.0,
        ge=0.0,
        le=1.0,
        description="of vehicles that are shown, chosen by id and seed; a smaller share is part of"
        " a larger one; those that rides, cameras and by_id name stay",
    )
