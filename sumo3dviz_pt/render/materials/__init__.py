"""Materials and textures of our own."""
