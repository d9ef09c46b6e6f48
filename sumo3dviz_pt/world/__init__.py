"""What exists, whatever looks at it."""
