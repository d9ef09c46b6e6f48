"""A path tracer of our own: one kernel on flat tables instead of calls of shapes and materials."""
