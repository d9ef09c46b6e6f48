"""Films in figures."""
