"""Lines in plan and the networks they form: ends, bridges, parting, joining, smoothing by PAEK and thinning."""
