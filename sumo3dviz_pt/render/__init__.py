"""Scene values to radiance; the only stage that imports Mitsuba."""

from sumo3dviz_pt.render import loading as loading
