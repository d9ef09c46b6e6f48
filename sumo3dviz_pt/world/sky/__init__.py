"""Sky, sun and darkness."""
