"""The town that is invented beside the roads of a network without polygons."""
