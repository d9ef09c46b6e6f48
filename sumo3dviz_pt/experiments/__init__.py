"""Experiments: designs, tables of trials, and the files of tools that show them; no scene."""
