"""Code that makes meshes and maps."""
