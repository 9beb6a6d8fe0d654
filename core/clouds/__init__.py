"""Point clouds: file formats, coordinate systems, and the points of the rail classes in local metres."""
