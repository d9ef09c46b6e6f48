"""The scene file: its settings and what they may hold."""
