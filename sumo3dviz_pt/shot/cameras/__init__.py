"""Cameras: where the eye is and what it sees with, at any time."""
