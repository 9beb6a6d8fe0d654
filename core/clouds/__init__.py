"""Point clouds: files, coordinate systems, and the points of wanted classes in local metres."""
