"""Trajectories of other tools, turned into SUMO's files."""

from sumo3dviz_pt.sumo.tracks.by_lane import LANE_ROOTS
from sumo3dviz_pt.sumo.tracks.convert import converted, in_sumos_form, is_table, tells_places
from sumo3dviz_pt.sumo.tracks.tables import why_no_table

__all__ = ["LANE_ROOTS", "converted", "in_sumos_form", "is_table", "tells_places", "why_no_table"]
