"""Lanes as a graph, the lines along them, and which of them a road user drove along."""
