"""Configurations of sumo3Dviz 1.0: values, files and cameras."""
