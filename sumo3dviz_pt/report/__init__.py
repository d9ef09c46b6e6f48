"""Error against run time, and films compared: measurements, tables, plots, pages."""
