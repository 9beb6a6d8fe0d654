"""The ruler: it compares extracted lines and tracks with the truth, next to those of a plain script."""
