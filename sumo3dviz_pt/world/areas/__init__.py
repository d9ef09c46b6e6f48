"""What covers the ground where polygons, or dense buildings, say what it is."""
