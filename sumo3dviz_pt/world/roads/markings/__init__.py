"""Paint on roads."""
