"""A scene at its edges."""
