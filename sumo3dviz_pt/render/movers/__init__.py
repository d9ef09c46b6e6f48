"""Road users in the renderer."""
