"""Looks at a scene before it is rendered: its files, road users, motion, bodies, keys."""
