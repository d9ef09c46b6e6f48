"""Passenger cars."""
