"""Rails followed from seeds in raw clouds (docs/growing.md)."""
