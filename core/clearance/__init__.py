"""Clearance: a structure gauge swept along tracks through a cloud, platforms, wires and the distance of tracks."""
