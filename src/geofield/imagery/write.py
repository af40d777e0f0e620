"""Writing a scene as a Cloud Optimized GeoTIFF, the same bytes every time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rasterio.shutil
from rasterio.enums import ColorInterp
from rasterio.errors import RasterioError
from rasterio.io import MemoryFile
from rasterio.windows import Window

from geofield.errors import FormatError, refuse_other
from geofield.imagery.gdal import gdal_env, to_rasterio
from geofield.imagery.tags import tags_of
from geofield.model.scene import OPEN_IT, Scene
from geofield.staging import staged_file

#: Creation options of GDAL's COG driver.
COG_OPTIONS: dict[str, Any] = {
    "driver": "COG",
    "BLOCKSIZE": 512,
    "COMPRESS": "DEFLATE",
    "PREDICTOR": "YES",
    "LEVEL": 1,  # a third of the time of the default, for files 3 % larger
    "OVERVIEW_RESAMPLING": "AVERAGE",
    "BIGTIFF": "IF_SAFER",
}

_INTERPRETATION = {
    "red": ColorInterp.red,
    "green": ColorInterp.green,
    "blue": ColorInterp.blue,
    "grey": ColorInterp.gray,
    "nir": ColorInterp.nir,
    "other": ColorInterp.undefined,
}


def write_scene(scene: Scene, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a scene as a COG with overviews, mask, provenance and its exact position.

    >>> scene = gf.read_scene("sample_data/field_1.tif")
    >>> gf.write_scene(scene, "copy.tif")  # doctest: +SKIP

    512 px blocks, DEFLATE with predictor 2, an internal mask only where the scene has pixels
    without data. Written beside the target and moved into place.

    Parameters
    ----------
    scene : Scene
    path : path
    overwrite : bool
        Replace an existing file; refused by default.

    Returns
    -------
    Path
        Where it is.

    Raises
    ------
    OutputExistsError
    FormatError
        The folder does not exist, is read-only or full.
    """
    refuse_other(scene, Scene, "scene", OPEN_IT, FormatError)
    grid, count = scene.grid, len(scene.roles)
    with replacing(path, overwrite=overwrite) as temporary, gdal_env(GDAL_TIFF_INTERNAL_MASK=True):
        profile = {
            "driver": "GTiff",
            "width": grid.width_px,
            "height": grid.height_px,
            "count": count,
            "dtype": "uint8",
            "transform": grid.transform,
            "crs": to_rasterio(grid.crs),
            "photometric": "RGB" if scene.roles[:3] == ("red", "green", "blue") else "MINISBLACK",
        }
        if count > 3 or (count > 1 and not scene.is_colour):
            profile["ALPHA"] = "NO"
        with MemoryFile() as memory:
            with memory.open(**profile) as staged:
                staged.write(scene.bands)
                staged.colorinterp = [_INTERPRETATION[role] for role in scene.roles]
                for i, role in enumerate(scene.roles):
                    if role not in ("red", "green", "blue"):
                        staged.set_band_description(i + 1, role)
                if not scene.valid.all():
                    staged.write_mask(scene.valid)
                staged.update_tags(**tags_of(scene))
            with memory.open() as staged:
                write_cog(staged, temporary)
    return Path(path)


def write_cog(source: Any, target: Path, **options: Any) -> None:
    """Write a dataset of rasterio, or a file, as a COG, and see that all of it is there.

    Raises
    ------
    FormatError
        Also where a full disk cut it off, of which GDAL alone does not tell.
    """
    try:
        rasterio.shutil.copy(source, str(target), **COG_OPTIONS, **options)
        with rasterio.open(target) as written:
            # Its last block ends the file.
            last = Window(written.width - 1, written.height - 1, 1, 1)
            written.read(window=last)
            written.read_masks(window=last)
    except Exception as error:
        # GDAL's own errors come through; the class they have in common is not public.
        if not type(error).__module__.startswith("rasterio"):
            raise
        raise FormatError(
            f"{target.name} cannot be written to its end.", hint="Check the free space on the disk."
        ) from error


@contextmanager
def replacing(path: str | Path, *, overwrite: bool, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """A path to write a picture at, which takes its place when all went well; never an input's."""
    target = Path(path)
    if not target.parent.is_dir():
        raise FormatError(
            f"{target} cannot be written.",
            hint="Check that the folder exists and that you may write there.",
        )
    try:
        with staged_file(target, overwrite=overwrite, inputs=inputs) as temporary:
            yield temporary
    except RasterioError as error:
        raise FormatError(
            f"{target} cannot be written: {error}.", hint="Check the free space on the disk."
        ) from error
