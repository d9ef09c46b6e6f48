"""Overlays: what is drawn over developed pictures, from values alone."""
