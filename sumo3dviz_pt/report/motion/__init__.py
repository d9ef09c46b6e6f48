"""Motion in figures and drawings."""
