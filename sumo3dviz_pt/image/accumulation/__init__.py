"""Frames that help each other: what neighbours saw of the same things, for less noise."""
