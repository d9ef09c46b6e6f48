"""Bicycles, scooters, mopeds and motorcycles with their riders."""
