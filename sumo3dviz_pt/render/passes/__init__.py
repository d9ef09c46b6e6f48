"""From samples to a picture."""
