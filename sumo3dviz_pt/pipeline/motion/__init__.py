"""Looks at a log's motion."""
