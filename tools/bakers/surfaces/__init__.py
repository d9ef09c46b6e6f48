"""Maps of road, ground and wall surfaces."""
