"""Bridges, their piers and parapets, and retaining walls."""
