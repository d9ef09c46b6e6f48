"""Layers as files: what other tools read of a frame beside its picture."""
