"""Overlays of films: what they show is gathered, stored beside the frames, and drawn."""
