"""Design elements of a track: straights, arcs and clothoids, grades and parabolas, constant cant and ramps.

`elements` has the types and evaluates the curves, `table` writes and reads them as rows of the element table.
`stations`, `stationing`, `axis` and `km_text` have the kilometres along an axis.
"""
