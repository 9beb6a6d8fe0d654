"""The ruler: it compares extracted lines and tracks, and the lines of a plain script, with the truth."""
