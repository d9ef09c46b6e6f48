"""Everyone on the road: bodies, colours, lamps and poses at any time."""
