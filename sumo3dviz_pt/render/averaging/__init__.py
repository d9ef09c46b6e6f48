"""Averages frames of a film on the device that traced them."""
