"""Checks: what the user is told about points and lines that do not look like a railway."""
