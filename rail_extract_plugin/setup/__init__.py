"""Set-up: Python packages, their installation, and the self test."""
