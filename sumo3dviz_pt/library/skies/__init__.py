"""Clouds, and radiance maps that users bring."""
