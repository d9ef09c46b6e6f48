"""Buses, vans and lorries."""
