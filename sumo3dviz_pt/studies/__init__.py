"""Studies: from factors and a design to films that differ in one thing, and to tools' files."""
