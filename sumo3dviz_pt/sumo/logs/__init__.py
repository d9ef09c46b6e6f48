"""What is made from the rows of vehicle logs: packed rows, and logs that are kept on disk."""
