"""From rails to tracks: which rails make a track, the line midway between them, and its geometry."""
