"""The land: its heights, and what it looks like from above."""
