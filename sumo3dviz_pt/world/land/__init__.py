"""The ground, and the land to the horizon."""
