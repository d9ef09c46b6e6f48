"""Code that makes meshes and maps; it knows no scene."""
