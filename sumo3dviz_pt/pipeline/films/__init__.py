"""Films: frames, their order, their files."""
