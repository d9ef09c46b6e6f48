"""What is seen from inside a vehicle."""
