"""Design elements of a track: straights, arcs and clothoids, grades and parabolas, constant cant and ramps.

`elements` has the types and evaluates the curves, `fit` finds them along a measured track.
"""
