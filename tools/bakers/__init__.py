"""Makes the surface maps and cloud maps that lie in `assets/`."""
