"""Trains, trams, ships and containers: shells without road wheels."""
