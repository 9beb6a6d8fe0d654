"""Railways and their surveys drawn at random: a world is a function of its seed."""
