"""Track centerlines from airborne clouds, along guides that say which tracks are meant (docs/airborne.md)."""
