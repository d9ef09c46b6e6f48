"""Model and job to scene data: no Mitsuba."""
