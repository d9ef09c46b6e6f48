"""The files of tools that show films to people and record their answers."""
