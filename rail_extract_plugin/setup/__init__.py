"""Setup: required Python packages, their installation, and the self test."""
