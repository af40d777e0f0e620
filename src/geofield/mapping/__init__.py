"""Maps on paper and screen: a plan's tables drawn on its picture.

What comes in is a dataset and, where there is one, the scene; what goes out is a picture.
`picture` draws ``map.png`` with Pillow, quickly, with its numbers (`labels`), what stands below
(`panel`) and letters of every script (`fonts`); `plot` draws on matplotlib axes, for
``plan.plot()`` and for maps of which the lines stay lines. Words and scales that both need are in
`geofield.model.map_words`.
"""

from geofield.mapping.picture import draw_map

__all__ = ["draw_map"]
