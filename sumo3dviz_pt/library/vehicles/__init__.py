"""Vehicles from recipes, and those that users bring."""
