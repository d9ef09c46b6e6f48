"""Meshes, polygons and fields: what all models are made with."""
