"""Rows of houses along city streets."""
