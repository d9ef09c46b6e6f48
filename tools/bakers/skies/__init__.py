"""Cloud maps of skies."""
