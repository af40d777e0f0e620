"""A QGIS project: the picture below, the layers above, all styled, all paths relative."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from xml.etree import ElementTree as ET

import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import authority_name
from geofield.formats import origin
from geofield.formats.qgis.layer_style import look_of, style_attributes, style_elements
from geofield.formats.qgis.looks import ORDER
from geofield.formats.qgis.symbols import QGIS_VERSION
from geofield.model import Dataset
from geofield.model.frame import NEAR_PX, picture_frame

#: White space around the field in the first view, as a share of its size.
MARGIN = 0.08
# QGIS throws away layer ids of ten characters or fewer.
_ID = "geofield_{}"
_GEOMETRY = {
    "Point": "Point",
    "LineString": "Line",
    "MultiLineString": "Line",
    "Polygon": "Polygon",
    "MultiPolygon": "Polygon",
}


def project_xml(dataset: Dataset, gpkg_name: str) -> str:
    """The project (``.qgs``) over a GeoPackage in the same folder.

    Parameters
    ----------
    dataset : Dataset
        Its `scene_path`, where there is one, is taken to lie in the same folder too.
    gpkg_name : str
        File name of the GeoPackage.
    """
    layers = sorted(dataset.layers(working=True), key=lambda each: _place(each.name))
    root = ET.Element("qgis", projectname=dataset.name, version=QGIS_VERSION)
    ET.SubElement(root, "homePath", path="")
    ET.SubElement(root, "title").text = dataset.name
    root.append(_crs_element("projectCrs", dataset.crs))
    scene = None if dataset.scene_path is None else dataset.scene_path.name
    root.append(_layer_tree(dataset.name, layers, gpkg_name, scene))
    bounds = _first_view(dataset)
    root.append(_canvas(dataset.crs, bounds))
    root.append(_view_settings(dataset.crs, bounds))
    names = [each.name for each in layers] + (["scene"] if scene else [])
    order = ET.SubElement(root, "layerorder")
    for name in names:
        ET.SubElement(order, "layer", id=_ID.format(name))
    project_layers = ET.SubElement(root, "projectlayers")
    for layer in layers:
        project_layers.append(_vector_layer(layer, dataset, gpkg_name))
    if dataset.scene_path is not None:
        project_layers.append(_raster_layer(dataset, dataset.scene_path))
    root.append(_properties(dataset))
    metadata = ET.SubElement(root, "projectMetadata")
    ET.SubElement(metadata, "title").text = dataset.name
    ET.SubElement(metadata, "abstract").text = origin.lineage(dataset)
    return (
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
        f"{ET.tostring(root, encoding='unicode')}\n"
    )


def qgz_bytes(xml: str, stem: str, timestamp: str) -> bytes:
    """A project as ``.qgz``: a ZIP archive with one ``.qgs``, stamped with a fixed time."""
    year, month, day = (int(part) for part in timestamp[:10].split("-"))
    info = zipfile.ZipInfo(f"{stem}.qgs", (max(year, 1980), month, day, 0, 0, 0))
    info.compress_type = zipfile.ZIP_DEFLATED
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(info, xml.encode())
    return buffer.getvalue()


def frame_strip(dataset: Dataset) -> str:
    """A narrow strip along the picture's frame, WKT; empty where the outline is not of it."""
    field, grid = dataset.table(schema.FIELD.name), dataset.grid
    if grid is None or not len(field) or field["method"].iloc[0] == "boundary":
        return ""
    frame = picture_frame(grid, dataset.crs)
    strip = shapely.buffer(frame.exterior, NEAR_PX * grid.ground_resolution_m, join_style="mitre")
    return str(shapely.to_wkt(strip, rounding_precision=3))


def _place(name: str) -> int:
    return ORDER.index(name) if name in ORDER else len(ORDER)


def _crs_element(tag: str, crs: CRS) -> ET.Element:
    root = ET.Element(tag)
    system = ET.SubElement(root, "spatialrefsys", nativeFormat="Wkt")
    name = authority_name(crs)
    ET.SubElement(system, "wkt").text = crs.to_wkt()
    ET.SubElement(system, "authid").text = name if ":" in name else ""
    ET.SubElement(system, "srid").text = name.rpartition(":")[2] if ":" in name else "0"
    ET.SubElement(system, "description").text = crs.name
    ET.SubElement(system, "geographicflag").text = "true" if crs.is_geographic else "false"
    return root


def _layer_tree(
    name: str, layers: list[schema.Layer], gpkg_name: str, scene: str | None
) -> ET.Element:
    root = ET.Element("layer-tree-group")
    group = ET.SubElement(root, "layer-tree-group", name=name, expanded="1", checked="Qt::Checked")
    for layer in layers:
        ET.SubElement(
            group,
            "layer-tree-layer",
            id=_ID.format(layer.name),
            name=layer.title,
            source=_source(gpkg_name, layer.name),
            providerKey="ogr",
            checked="Qt::Checked" if look_of(layer).visible else "Qt::Unchecked",
            expanded="1" if layer.name == "obstacles" else "0",
        )
    if scene is not None:
        ET.SubElement(
            root,
            "layer-tree-layer",
            id=_ID.format("scene"),
            name="Picture",
            source=f"./{scene}",
            providerKey="gdal",
            checked="Qt::Checked",
            expanded="0",
        )
    return root


def _source(gpkg_name: str, layer: str) -> str:
    return f"./{gpkg_name}|layername={layer}"


def _vector_layer(layer: schema.Layer, dataset: Dataset, gpkg_name: str) -> ET.Element:
    root = ET.Element(
        "maplayer",
        {"type": "vector", "geometry": _GEOMETRY[layer.geometry], "autoRefreshEnabled": "0"}
        | style_attributes(layer),
    )
    _text(root, "id", _ID.format(layer.name))
    _text(root, "datasource", _source(gpkg_name, layer.name))
    _text(root, "layername", layer.title)
    _text(root, "abstract", layer.description)
    root.append(_crs_element("srs", dataset.crs))
    _text(root, "provider", "ogr").set("encoding", "UTF-8")
    root.extend(style_elements(layer, frame_strip(dataset)))
    return root


def _raster_layer(dataset: Dataset, path: Path) -> ET.Element:
    root = ET.Element("maplayer", type="raster", autoRefreshEnabled="0")
    _text(root, "id", _ID.format("scene"))
    _text(root, "datasource", f"./{path.name}")
    _text(root, "layername", "Picture")
    _text(root, "abstract", origin.lineage(dataset))
    if dataset.grid is not None:
        root.append(_crs_element("srs", dataset.grid.crs))
    _text(root, "provider", "gdal")
    pipe = ET.SubElement(root, "pipe")
    bands = _colour_bands(path)
    attributes = {"opacity": "1", "alphaBand": "-1"}
    if len(bands) == 3:
        red, green, blue = (str(band) for band in bands)
        ET.SubElement(
            pipe,
            "rasterrenderer",
            {"type": "multibandcolor", "redBand": red, "greenBand": green, "blueBand": blue}
            | attributes,
        )
    else:
        renderer = ET.SubElement(
            pipe,
            "rasterrenderer",
            {"type": "singlebandgray", "grayBand": str(bands[0]), "gradient": "BlackToWhite"}
            | attributes,
        )
        stretch = ET.SubElement(renderer, "contrastEnhancement")
        _text(stretch, "minValue", "0")
        _text(stretch, "maxValue", "255")
        _text(stretch, "algorithm", "StretchToMinimumMaximum")
    return root


def _colour_bands(path: Path) -> tuple[int, ...]:
    """Red, green and blue of a picture, or its one band; 1, 2, 3 before it is written."""
    if not path.exists():
        return (1, 2, 3)
    import rasterio
    from rasterio.enums import ColorInterp

    # Only what holds its pixels itself: the file may be a stranger's.
    with rasterio.open(path, driver="GTiff") as picture:
        roles = list(picture.colorinterp)
        wanted = (ColorInterp.red, ColorInterp.green, ColorInterp.blue)
        if all(role in roles for role in wanted):
            return tuple(roles.index(role) + 1 for role in wanted)
        return (1, 2, 3) if picture.count >= 3 else (1,)


def _first_view(dataset: Dataset) -> dict[str, str]:
    """The extent shown at first: the field with some space around."""
    field = dataset.table("field")
    tables = [field] if len(field) else [each for each in dataset.tables.values() if len(each)]
    bounds = tables[0].total_bounds if tables else (0.0, 0.0, 1.0, 1.0)
    west, south, east, north = (float(value) for value in bounds)
    margin = MARGIN * max(east - west, north - south)
    return {
        "xmin": repr(west - margin),
        "ymin": repr(south - margin),
        "xmax": repr(east + margin),
        "ymax": repr(north + margin),
    }


def _canvas(crs: CRS, bounds: dict[str, str]) -> ET.Element:
    root = ET.Element("mapcanvas", name="theMapCanvas", annotationsVisible="1")
    _text(root, "units", "meters")
    extent = ET.SubElement(root, "extent")
    for tag, value in bounds.items():
        _text(extent, tag, value)
    _text(root, "rotation", "0")
    root.append(_crs_element("destinationsrs", crs))
    return root


def _view_settings(crs: CRS, bounds: dict[str, str]) -> ET.Element:
    root = ET.Element("ProjectViewSettings", UseProjectScales="0")
    ET.SubElement(root, "Scales")
    extent = ET.SubElement(root, "DefaultViewExtent", bounds)
    extent.append(_crs_element("crs", crs)[0])
    return root


def _properties(dataset: Dataset) -> ET.Element:
    root = ET.Element("properties")
    reference = ET.SubElement(root, "SpatialRefSys")
    # Without this property QGIS ignores the project's CRS in silence.
    _text(reference, "ProjectionsEnabled", "1").set("type", "int")
    paths = ET.SubElement(root, "Paths")
    _text(paths, "Absolute", "false").set("type", "bool")
    measurement = ET.SubElement(root, "Measurement")
    _text(measurement, "DistanceUnits", "meters").set("type", "QString")
    _text(measurement, "AreaUnits", "ha").set("type", "QString")
    measure = ET.SubElement(root, "Measure")
    _text(measure, "Ellipsoid", "EPSG:7030").set("type", "QString")
    gui = ET.SubElement(root, "Gui")
    for tag, value in (
        ("CanvasColorRedPart", "245"),
        ("CanvasColorGreenPart", "245"),
        ("CanvasColorBluePart", "240"),
    ):
        _text(gui, tag, value).set("type", "int")
    return root


def _text(parent: ET.Element, tag: str, text: str) -> ET.Element:
    element = ET.SubElement(parent, tag)
    element.text = text
    return element
