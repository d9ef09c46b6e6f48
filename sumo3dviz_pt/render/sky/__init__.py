"""Skies as radiance maps."""
