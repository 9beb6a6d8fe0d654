"""Lines of two surveys, or of a survey and a design, compared metre by metre.

`pieces` finds the nearest place of lines, and gauge and cant between two of them, `shift` the constant shift of one
survey against the other, and `tracks` compares. See docs/comparison.md.
"""
