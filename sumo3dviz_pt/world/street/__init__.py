"""Street lamps, signs and furniture."""
