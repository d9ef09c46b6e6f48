"""Scene values to radiance; the only stage that imports Mitsuba."""
