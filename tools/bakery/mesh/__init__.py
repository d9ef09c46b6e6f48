"""Bodies as fields: meshing, cutting and simplifying their surfaces."""
