"""The map tool that follows rails from clicks."""
