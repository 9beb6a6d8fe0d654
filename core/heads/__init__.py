"""What the points tell of the railheads: where their axes lie, how high their tops, and how surely."""
