"""Radiance in files and radiance as pixels: EXR, exposure, tone curves, PNG, metrics."""
