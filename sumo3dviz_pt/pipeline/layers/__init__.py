"""Layers of films: what is asked for, written beside every frame, and read again."""
