"""Traffic lights."""
