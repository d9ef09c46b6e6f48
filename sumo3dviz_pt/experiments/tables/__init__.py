"""Design tables of other tools, read as these write them."""
