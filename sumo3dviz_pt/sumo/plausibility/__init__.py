"""Say what seems wrong with a vehicle log: its places, angles, speeds, heights and times."""
