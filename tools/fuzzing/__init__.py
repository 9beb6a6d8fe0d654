"""Damaged files, made from good ones, and what reading them must come to; `tools/fuzz.py` runs them."""
