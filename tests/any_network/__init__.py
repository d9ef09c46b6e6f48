"""Networks of every kind that SUMO can write, their traffic, and laws of what is drawn of them."""
