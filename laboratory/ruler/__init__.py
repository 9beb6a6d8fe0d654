"""The ruler: extracted lines and tracks compared with the truth and with a plain script."""
