"""Auto: the field around points, from what the picture shows and a network has learned.

A network that sees the points says how likely each place belongs to the field (`looks`). Its ground
at a few levels of likelihood becomes straight outlines (`answer`), what a person said changes those
that were taken before (`mend`; all in `search`). The best is taken by what the picture shows along
them (`border`, `ranking`), others that may be meant are offered (both in `likely`), and all are
carried to the picture's own pixels (`refine`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from geofield.field.likely import Likely, other_outlines
from geofield.field.morphology import inner, plump
from geofield.field.points import Points
from geofield.field.refine import carried
from geofield.field.search import WindowSearch, search_field
from geofield.model import Scene
from geofield.model.segmentation import Segmentation

#: A border weaker than this, in units of what the field has inside, is none.
_WEAK = 1.6
#: Borders close inside are told from this strength on, as a share of the outline's own; a
#: crooked course below this share of long sides.
_RIVAL, _CROOKED = 0.75, 0.8
#: Below this certainty the doubt is told; from the other one on the network is not asked for other
#: ground: on 46 such fields of left-out sites it gained nothing.
_LIKELY, _SURE = 0.7, 0.85


def segment(
    scene: Scene,
    x_px: float,
    y_px: float,
    *,
    include: Points = (),
    exclude: Points = (),
    search: WindowSearch | None = None,
) -> Segmentation:
    """The field around points, with the most likely other ones.

    Parameters
    ----------
    scene : Scene
    x_px, y_px : float
        The seed, pixel coordinates.
    include, exclude : sequence of (float, float)
        Further points that belong and that do not, pixel coordinates.
    search : WindowSearch, optional
        Of the same scene and seed, from an earlier call.
    """
    if search is None:
        search = search_field(scene, x_px, y_px)
    belong, apart = (tuple(search.place(*at) for at in one) for one in (include, exclude))
    found, taken = search.answer(belong, apart)
    if taken is None:
        # Nothing stands out of anything: one surface fills the picture.
        return Segmentation(scene.valid, ("no border was found anywhere",), (("certainty", 0.0),))
    # Who gives further points does not choose between grounds any more.
    ask = not (belong or apart) and taken.certainty < _SURE
    more = search.imagined() if ask else ()
    likely = [taken, *other_outlines(taken, [*found, *more])]
    outlines = [one.candidate.polygon for one in likely]
    points = (search.seed_px, *belong), apart
    masks = carried(scene, outlines, search.factor, *points, times=search.seen.times)
    chosen, *others = (
        _told(scene, search, one, mask) for one, mask in zip(likely, masks, strict=True)
    )
    return replace(chosen, alternatives=tuple(others))


def _told(
    scene: Scene, search: WindowSearch, likely: Likely, mask: NDArray[np.bool_]
) -> Segmentation:
    """An outline on the picture's own pixels, with what is to be told of it."""
    things = plump(likely.candidate.holes | search.things)
    large = things.repeat(search.factor, axis=0).repeat(search.factor, axis=1)
    holes = inner(large[: mask.shape[0], : mask.shape[1]], mask)
    figures = likely.candidate.figures
    contrast = math.exp(figures["strength_50_above_inside"])
    weakest = math.exp(figures["strength_25_above_inside"])
    notes = []
    if search.moved:
        notes.append("the point lies on something small (a tree, a hut, a track?)")
    if likely.ground < _LIKELY:
        notes.append(f"other ground may be meant (certainty {likely.certainty:.0%})")
    elif likely.certainty < _LIKELY:
        notes.append(f"where it ends is not certain (certainty {likely.certainty:.0%})")
    if likely.certainty < _LIKELY:
        if contrast < _WEAK:
            notes.append("its border hardly differs from what lies inside")
        elif weakest < _WEAK:
            notes.append("a quarter of its border or more is weak")
        if math.exp(figures["inside_95_above_border"]) > _RIVAL:
            notes.append("borders close inside it are nearly as strong as its own")
        if figures["long_sides_share"] < _CROOKED:
            notes.append("much of its course is crooked")
    return Segmentation(
        mask & ~holes & scene.valid,
        tuple(notes),
        (
            ("certainty", likely.certainty),
            ("ground_certainty", likely.ground),
            ("border_certainty", likely.border),
            ("border_contrast", contrast),
            ("weakest_quarter", weakest),
            ("straightness", figures["long_sides_share"]),
        ),
    )
