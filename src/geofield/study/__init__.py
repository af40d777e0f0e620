"""The study's own method, for who comes from the thesis or compares with it.

In come a scene's grey picture and the field as pixels or polygon; out go numbered regions,
circles and the longest edge, as values of `geofield.model`. The stages reach this room by the
names in `geofield.methods` and load it only when one of them is asked for; nothing here knows
the stages.

To read from top to bottom, in the order of the thesis:

1. `threshold`: grey, median, Otsu, box sum, numbered regions, reconstruction; `pictures`
   draws them.
2. `edges`: Sobel, Prewitt, Roberts and Canny edge maps with thresholds and thinning.
3. `accumulator`, `peaks`, `phase_code`: edge pixels vote for circles; PhaseCode and TwoStage
   read centres and radii from the votes.
4. `strategies`: which threshold and which edge method to trust (single, T-range, Max-of-All,
   DLC, consensus), each circle once.
5. `detectors`: all of that on a scene, and what is too bright. Begin here to follow a call from
   the command line.
6. `hough`: the longest straight edge of the field, which its tracks are parallel to.

Pixel coordinates within `edges` to `detectors` count from the centre of the top-left pixel.
"""
