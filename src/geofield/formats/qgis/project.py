"""A QGIS project: the picture below, the layers above, all styled, all paths relative."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from xml.etree import ElementTree as ET

from pyproj import CRS

from geofield import schema
from geofield.crs import authority_name
from geofield.errors import FormatError
from geofield.formats import origin
from geofield.formats.qgis.layer_style import style_of
from geofield.formats.qgis.looks import LOOKS
from geofield.formats.qgis.symbols import QGIS_VERSION, document
from geofield.formats.xml import node
from geofield.formats.zipped import add
from geofield.model import Dataset

#: White space around the field in the first view, as a share of its size.
MARGIN = 0.08
# QGIS throws away layer ids of ten characters or fewer.
_ID = "geofield_{}"


def project_xml(dataset: Dataset, gpkg_name: str) -> str:
    """The project (``.qgs``) over a GeoPackage in the same folder.

    Parameters
    ----------
    dataset : Dataset
        Its `scene_path`, where there is one, is taken to lie in the same folder too.
    gpkg_name : str
        File name of the GeoPackage.
    """
    from_top = list(LOOKS)
    layers = sorted(dataset.layers(working=True), key=lambda each: from_top.index(each.name))
    scene = dataset.scene_path
    names = [each.name for each in layers] + (["scene"] if scene else [])
    view = _first_view(dataset)
    pictures = [] if scene is None else [_raster_layer(dataset, scene)]
    root = node(
        "qgis",
        node("homePath", path=""),
        node("title", dataset.name),
        node("projectCrs", _system(dataset.crs)),
        _layer_tree(dataset.name, layers, gpkg_name, scene),
        node(
            "mapcanvas",
            node("units", "meters"),
            node("extent", *(node(tag, value) for tag, value in view.items())),
            node("rotation", "0"),
            node("destinationsrs", _system(dataset.crs)),
            name="theMapCanvas",
            annotationsVisible="1",
        ),
        node(
            "ProjectViewSettings",
            node("Scales"),
            node("DefaultViewExtent", view, _system(dataset.crs)),
            UseProjectScales="0",
        ),
        node("layerorder", *(node("layer", id=_ID.format(name)) for name in names)),
        node(
            "projectlayers",
            *(_vector_layer(each, dataset, gpkg_name) for each in layers),
            *pictures,
        ),
        _properties(),
        node(
            "projectMetadata",
            node("title", dataset.name),
            node("abstract", origin.lineage(dataset)),
        ),
        projectname=dataset.name,
        version=QGIS_VERSION,
    )
    return document(root)


def qgz_bytes(xml: str, stem: str, timestamp: str) -> bytes:
    """A project as ``.qgz``: a ZIP archive with one ``.qgs``, stamped with a fixed time."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        add(archive, f"{stem}.qgs", xml.encode(), timestamp[:10])
    return buffer.getvalue()


def _system(crs: CRS) -> ET.Element:
    name = authority_name(crs)
    known = ":" in name
    return node(
        "spatialrefsys",
        node("wkt", crs.to_wkt()),
        node("authid", name if known else ""),
        node("srid", name.rpartition(":")[2] if known else "0"),
        node("description", crs.name),
        node("geographicflag", "true" if crs.is_geographic else "false"),
        nativeFormat="Wkt",
    )


def _layer_tree(
    name: str, layers: list[schema.Layer], gpkg_name: str, scene: Path | None
) -> ET.Element:
    leaves = [_leaf(each.name, each.title, _source(gpkg_name, each.name), "ogr") for each in layers]
    group = node("layer-tree-group", *leaves, name=name, expanded="1", checked="Qt::Checked")
    picture = [] if scene is None else [_leaf("scene", "Picture", f"./{scene.name}", "gdal")]
    return node("layer-tree-group", group, *picture)


def _leaf(name: str, title: str, source: str, provider: str) -> ET.Element:
    shown = name not in LOOKS or LOOKS[name].visible
    return node(
        "layer-tree-layer",
        id=_ID.format(name),
        name=title,
        source=source,
        providerKey=provider,
        checked="Qt::Checked" if shown else "Qt::Unchecked",
        expanded="1" if name == "obstacles" else "0",
    )


def _source(gpkg_name: str, layer: str) -> str:
    return f"./{gpkg_name}|layername={layer}"


def _vector_layer(layer: schema.Layer, dataset: Dataset, gpkg_name: str) -> ET.Element:
    shape = layer.geometry.removeprefix("Multi").removesuffix("String")
    return node(
        "maplayer",
        {"type": "vector", "geometry": shape, "autoRefreshEnabled": "0"},
        node("id", _ID.format(layer.name)),
        node("datasource", _source(gpkg_name, layer.name)),
        node("layername", layer.title),
        node("abstract", layer.description),
        node("srs", _system(dataset.crs)),
        node("provider", "ogr", encoding="UTF-8"),
        *style_of(layer, dataset),
    )


def _raster_layer(dataset: Dataset, path: Path) -> ET.Element:
    bands = [str(band) for band in _colour_bands(path)]
    if len(bands) == 3:
        names = {"type": "multibandcolor"}
        names |= dict(zip(("redBand", "greenBand", "blueBand"), bands, strict=True))
        stretch = []
    else:
        names = {"type": "singlebandgray", "grayBand": bands[0], "gradient": "BlackToWhite"}
        limits = {"minValue": "0", "maxValue": "255", "algorithm": "StretchToMinimumMaximum"}
        parts = (node(tag, value) for tag, value in limits.items())
        stretch = [node("contrastEnhancement", *parts)]
    renderer = node("rasterrenderer", names, *stretch, opacity="1", alphaBand="-1")
    system = [] if dataset.grid is None else [node("srs", _system(dataset.grid.crs))]
    return node(
        "maplayer",
        node("id", _ID.format("scene")),
        node("datasource", f"./{path.name}"),
        node("layername", "Picture"),
        node("abstract", origin.lineage(dataset)),
        *system,
        node("provider", "gdal"),
        node("pipe", renderer),
        type="raster",
        autoRefreshEnabled="0",
    )


def _colour_bands(path: Path) -> tuple[int, ...]:
    """Red, green and blue of a picture, or its one band; 1, 2, 3 before it is written."""
    if not path.exists():
        return (1, 2, 3)
    import rasterio
    from rasterio.enums import ColorInterp
    from rasterio.errors import RasterioIOError

    try:
        # Only what holds its pixels itself: the file may be a stranger's.
        with rasterio.open(path, driver="GTiff") as picture:
            roles, count = list(picture.colorinterp), picture.count
    except RasterioIOError as error:
        raise FormatError(
            f"The picture {path} of the plan cannot be read: {str(error).rstrip('.')}.",
            hint="Put a whole one there that you may read, or take it away, then repeat.",
        ) from None
    wanted = (ColorInterp.red, ColorInterp.green, ColorInterp.blue)
    if all(role in roles for role in wanted):
        return tuple(roles.index(role) + 1 for role in wanted)
    return (1, 2, 3) if count >= 3 else (1,)


def _first_view(dataset: Dataset) -> dict[str, str]:
    """The extent shown at first: the field with some space around."""
    field = dataset.table("field")
    tables = [field] if len(field) else [each for each in dataset.tables.values() if len(each)]
    bounds = tables[0].total_bounds if tables else (0.0, 0.0, 1.0, 1.0)
    west, south, east, north = (float(value) for value in bounds)
    margin = MARGIN * max(east - west, north - south)
    corners = (west - margin, south - margin, east + margin, north + margin)
    return dict(zip(("xmin", "ymin", "xmax", "ymax"), map(repr, corners), strict=True))


def _properties() -> ET.Element:
    return node(
        "properties",
        # Without this property QGIS ignores the project's CRS in silence.
        node("SpatialRefSys", node("ProjectionsEnabled", "1", type="int")),
        node("Paths", node("Absolute", "false", type="bool")),
        node(
            "Measurement",
            node("DistanceUnits", "meters", type="QString"),
            node("AreaUnits", "ha", type="QString"),
        ),
        node("Measure", node("Ellipsoid", "EPSG:7030", type="QString")),
        node(
            "Gui",
            node("CanvasColorRedPart", "245", type="int"),
            node("CanvasColorGreenPart", "245", type="int"),
            node("CanvasColorBluePart", "240", type="int"),
        ),
    )
