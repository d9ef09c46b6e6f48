"""How far long work is, and how long it will take."""
