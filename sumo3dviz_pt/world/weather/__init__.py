"""What the scene file says about the weather."""
