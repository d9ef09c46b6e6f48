"""The stimulus report: what the films of a study show, in numbers."""
