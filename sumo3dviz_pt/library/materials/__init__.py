"""Materials in Mitsuba's words, and surfaces by key."""
