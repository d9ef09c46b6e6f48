"""Designs: which combinations of levels are shown."""
