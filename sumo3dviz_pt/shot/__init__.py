"""What a camera sees of the world and the cast over a stretch of time."""
