"""Repair the geometry of networks, and say once what was repaired."""
