"""Rail points in raw clouds of any size: sorted into squares on disk, classified square by square, written to files."""
