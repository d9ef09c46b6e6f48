"""People from recipes."""
