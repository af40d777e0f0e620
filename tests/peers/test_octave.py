"""Edge maps and circles against GNU Octave's image package, an independent implementation."""

import shutil
import subprocess

import numpy as np
import pytest
from scipy import ndimage
from scipy.io import loadmat, savemat
from scipy.spatial import cKDTree

from geofield.study.edges import EdgeScan
from geofield.study.phase_code import find_circles

pytestmark = pytest.mark.octave

SCRIPT = """
pkg load image
load input.mat
for k = 1:size(pictures, 3)
  I = pictures(:, :, k);
  edges{k, 1} = edge(I, 'sobel');
  edges{k, 2} = edge(I, 'prewitt');
  edges{k, 3} = edge(I, 'roberts');
  edges{k, 4} = edge(I, 'sobel', 0.05);
  edges{k, 5} = edge(I, 'prewitt', 0.05);
  edges{k, 6} = edge(I, 'roberts', 0.05);
  edges{k, 7} = edge(framed(:, :, k), 'canny', 0.3);
  [c, r] = imfindcircles(I, [4 18], 'ObjectPolarity', 'dark', 'Sensitivity', 0.93);
  grey{k} = [c r];
  [c, r] = imfindcircles(edges{k, 4}, [4 18], 'ObjectPolarity', 'bright', 'Sensitivity', 0.85);
  logical{k} = [c r];
end
save -6 output.mat edges grey logical
"""
METHODS = ("sobel", "prewitt", "roberts", "sobel", "prewitt", "roberts")
THRESHOLDS = (None, None, None, 0.05, 0.05, 0.05)


def scenes(count=6, size=160):
    """Fields with crowns, soil texture and noise."""
    y, x = np.mgrid[:size, :size]
    for seed in range(count):
        rng = np.random.default_rng(seed)
        grey = 0.6 + 0.05 * ndimage.gaussian_filter(rng.normal(size=(size, size)), 6) * 20
        for _ in range(14):
            cx, cy = rng.uniform(10, size - 10, 2)
            radius = rng.uniform(4.5, 16)
            cover = np.clip(radius + 0.5 - np.hypot(x - cx, y - cy), 0, 1)
            grey = grey * (1 - cover) + rng.uniform(0.15, 0.35) * cover
        grey = ndimage.gaussian_filter(grey, 0.7) + rng.normal(0, 0.01, grey.shape)
        yield np.round(np.clip(grey, 0, 1) * 255) / 255


@pytest.fixture(scope="module")
def peer(tmp_path_factory):
    octave = shutil.which("octave")
    if octave is None:
        pytest.skip("GNU Octave is not installed (Debian: octave octave-image)")
    folder = tmp_path_factory.mktemp("octave")
    pictures = np.stack(list(scenes()), axis=2)
    # Octave pads with zeros before Canny's gradient; a picture that fades to zero at its
    # border leaves that difference out of the comparison.
    fade = np.clip(np.minimum(*np.mgrid[:160, :160]) / 20, 0, 1)
    fade = np.minimum(fade, fade[::-1, ::-1])
    framed = pictures * fade[:, :, None]
    savemat(folder / "input.mat", {"pictures": pictures, "framed": framed})
    (folder / "run.m").write_text(SCRIPT)
    run = subprocess.run(
        [octave, "--no-gui", "-q", "run.m"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    if "image package" in run.stderr and not (folder / "output.mat").exists():
        pytest.skip("Octave has no image package (Debian: octave-image)")
    assert (folder / "output.mat").exists(), run.stderr
    return pictures, framed, loadmat(folder / "output.mat")


def test_gradient_edge_maps_are_identical_but_for_ties(peer):
    pictures, _, theirs = peer
    different = total = 0
    for k in range(pictures.shape[2]):
        for j, (method, threshold) in enumerate(zip(METHODS, THRESHOLDS, strict=True)):
            scan = EdgeScan.of(pictures[:, :, k], method)  # type: ignore[arg-type]
            ours = scan.at(scan.default_threshold if threshold is None else threshold)
            different += int((ours != theirs["edges"][k, j].astype(bool)).sum())
            total += ours.size
    assert different / total < 5e-4


def test_canny_edges_lie_where_octave_sees_them(peer):
    _, framed, theirs = peer
    for k in range(framed.shape[2]):
        ours = EdgeScan.of(framed[:, :, k], "canny").at(0.3)
        other = theirs["edges"][k, 6].astype(bool)
        assert ours.any()
        assert other.any()
        to_ours = ndimage.distance_transform_edt(~ours)
        to_other = ndimage.distance_transform_edt(~other)
        assert np.mean(to_ours[other] < 1.5) > 0.85
        assert np.mean(to_other[ours] < 1.5) > 0.85


def compare(found, theirs, centre_limit):
    """Share of the circles within the limit, and the radius errors of those."""
    tree = cKDTree(np.column_stack([found.x_px, found.y_px]))
    # Octave counts the centres of pixels from one.
    distance, index = tree.query(theirs[:, :2] - 0.5)
    close = distance < centre_limit
    return close, np.abs(found.radius_px[index] - theirs[:, 2])


def test_phase_code_on_grey_finds_the_same_circles(peer):
    pictures, _, theirs = peer
    circles = 0
    for k in range(pictures.shape[2]):
        found = find_circles(pictures[:, :, k], (4, 18), polarity="dark", sensitivity=0.93)
        other = theirs["grey"][0, k]
        assert len(found) == len(other)
        close, radius_error = compare(found, other, 1e-4)
        assert close.all()
        # The phase is read at the pixel of the centre; for a centre half-way between two
        # pixels Octave's rounding error decides which one that is.
        tie = np.abs((other[:, :2] % 1) - 0.5).min(axis=1) < 1e-9
        assert radius_error[~tie].max() < 1e-3
        circles += len(other)
    assert circles > 40


def test_phase_code_on_edge_maps_finds_the_same_circles(peer):
    pictures, _, theirs = peer
    close_all, circles = 0, 0
    for k in range(pictures.shape[2]):
        edges = EdgeScan.of(pictures[:, :, k], "sobel").at(0.05)
        found = find_circles(edges, (4, 18), polarity="bright", sensitivity=0.85)
        other = theirs["logical"][0, k]
        assert len(found) == len(other)
        close, _ = compare(found, other, 0.01)
        close_all += int(close.sum())
        circles += len(other)
    assert circles > 20
    assert close_all >= 0.8 * circles
