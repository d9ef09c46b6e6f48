"""Buildings over any plan."""
