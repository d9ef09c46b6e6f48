"""Baked clouds as maps, and radiance maps that users bring."""
