"""Rules of ISO 11783-10 for customer, farm, field, polygons, lines, points and guidance.

What the schema says of these elements, in code: the schema files are not freely licensed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

from geofield.formats.isoxml.codes import DESIGNATOR
from geofield.formats.registry import task_file
from geofield.formats.validation import Finding
from geofield.formats.xml import read_xml

#: Attributes that must be there, by element.
_REQUIRED = {
    "CTR": "AB",
    "FRM": "AB",
    "PFD": "ACD",
    "PLN": "A",
    "LSG": "A",
    "PNT": "ACD",
    "GGP": "A",
    "GPN": "AC",
}
_IDS = ("CTR", "FRM", "PFD", "GGP", "GPN")
#: The codes that are allowed, by version, element and attribute.
_CODES = {
    3: {("PLN", "A"): range(1, 9), ("LSG", "A"): range(1, 9), ("PNT", "A"): range(1, 3)},
    4: {
        ("PLN", "A"): range(1, 13),
        ("LSG", "A"): range(1, 10),
        ("PNT", "A"): range(1, 12),
        ("GPN", "C"): range(1, 6),
        ("GPN", "E"): range(1, 5),
        ("GPN", "F"): range(1, 5),
    },
}
#: Attribute that holds a reference, and the element it must name.
_REFERENCES = {("PFD", "E"): "CTR", ("PFD", "F"): "FRM", ("FRM", "I"): "CTR"}
_DESIGNATORS = {"CTR": "B", "FRM": "B", "PFD": "C", "PLN": "B", "LSG": "B", "PNT": "B",
                "GGP": "B", "GPN": "B"}  # fmt: skip
_ORDER_V4 = ("PLN", "LSG", "PNT", "GGP")


def check(path: Path) -> Iterator[Finding]:
    """Findings in a ``TASKDATA.XML`` or the folder that holds it."""
    file = task_file(path)
    root = read_xml(file)
    if file.name != "TASKDATA.XML":
        yield Finding("error", file.name, "terminals look for TASKDATA.XML in capitals")
    if root.tag != "ISO11783_TaskData":
        yield Finding("error", file.name, f"the root is {root.tag}, not ISO11783_TaskData")
        return
    version = root.get("VersionMajor", "")
    if version not in ("2", "3", "4"):
        yield Finding("error", file.name, f"VersionMajor is {version!r}, not 3 or 4")
        return
    for name in ("VersionMinor", "DataTransferOrigin"):
        if not _is_whole(root.get(name, "")):
            yield Finding("error", file.name, f"the root lacks {name}")
    codes = _CODES[4 if version == "4" else 3]
    ids: set[str] = set()
    for element in root.iter():
        yield from _check_element(element, codes, ids)
        if version != "4" and element.tag in ("GGP", "GPN"):
            yield Finding("error", element.tag, "guidance groups are of version 4")
    yield from _check_references(root, ids)
    for field in root.iter("PFD"):
        yield from _check_field(field)


def _is_whole(text: str) -> bool:
    """Whether a text is digits alone, those of XML: Python's are more, as ²."""
    return text.isascii() and text.isdigit()


def _check_element(
    element: ET.Element, codes: dict[tuple[str, str], range], ids: set[str]
) -> Iterator[Finding]:
    tag = element.tag
    where = f"{tag} {element.get('B') or element.get('A') or ''}".strip()
    for attribute in _REQUIRED.get(tag, ""):
        if not element.get(attribute):
            yield Finding("error", where, f"the attribute {attribute} is missing")
    if tag in _IDS:
        own = element.get("A", "")
        if not re.fullmatch(rf"{tag}-?[0-9]+", own) or not 4 <= len(own) <= 14:
            yield Finding("error", where, f"the id {own!r} is not {tag} and digits")
        if own in ids:
            yield Finding("error", where, f"the id {own!r} is there twice")
        ids.add(own)
    name = element.get(_DESIGNATORS.get(tag, ""), "")
    if len(name) > DESIGNATOR:
        yield Finding("error", where, f"the designator has {len(name)} of {DESIGNATOR} characters")
    for (owner, attribute), allowed in codes.items():
        value = element.get(attribute)
        if owner == tag and value is not None and not (_is_whole(value) and int(value) in allowed):
            yield Finding("error", where, f"{attribute}={value!r} is no code of this version")
    if tag == "PNT":
        yield from _check_position(element, where)


def _check_position(point: ET.Element, where: str) -> Iterator[Finding]:
    for attribute, limit in (("C", 90.0), ("D", 180.0)):
        text = point.get(attribute, "")
        if not re.fullmatch(r"[-+]?[0-9]+(\.[0-9]{1,9})?", text):
            yield Finding("error", where, f"{attribute}={text!r} is no number with 9 decimals")
        elif abs(float(text)) > limit:
            yield Finding("error", where, f"{attribute}={text} is beyond {limit:g} degrees")


def _check_references(root: ET.Element, ids: set[str]) -> Iterator[Finding]:
    for (owner, attribute), target in _REFERENCES.items():
        for element in root.iter(owner):
            value = element.get(attribute)
            if value is not None and (value not in ids or not value.startswith(target)):
                yield Finding(
                    "error", f"{owner} {element.get('A')}", f"{attribute}={value!r} names nothing"
                )


def _check_field(field: ET.Element) -> Iterator[Finding]:
    where = f"PFD {field.get('C')}"
    if not _is_whole(field.get("D", "")):
        yield Finding("error", where, f"the area D={field.get('D')!r} is not whole square metres")
    order = [_ORDER_V4.index(child.tag) for child in field if child.tag in _ORDER_V4]
    if order != sorted(order):
        yield Finding("error", where, f"children are not in the order {', '.join(_ORDER_V4)}")
    for polygon in field.iter("PLN"):
        yield from _check_polygon(polygon)
    for pattern in field.iter("GPN"):
        yield from _check_pattern(pattern)


def _check_polygon(polygon: ET.Element) -> Iterator[Finding]:
    where = f"PLN {polygon.get('B')}"
    if not any(line.get("A") == "1" for line in polygon.findall("LSG")):
        yield Finding("error", where, "no exterior ring")
    for line in polygon.findall("LSG"):
        points = [(p.get("C"), p.get("D")) for p in line.findall("PNT")]
        if len(points) < 4 or points[0] != points[-1]:
            yield Finding("warning", where, "a ring is not closed")


def _check_pattern(pattern: ET.Element) -> Iterator[Finding]:
    where = f"GPN {pattern.get('B')}"
    lines = pattern.findall("LSG")
    if len(lines) != 1:
        yield Finding("error", where, f"{len(lines)} lines instead of one")
        return
    kinds = [point.get("A") for point in lines[0].findall("PNT")]
    if pattern.get("C") == "1" and kinds != ["6", "7"]:
        yield Finding("error", where, "an AB line is a point 6, then a 7")
    heading = pattern.get("G")
    number = None if heading is None else re.fullmatch(r"[0-9]{1,3}(\.[0-9]+)?", heading)
    if heading is not None and (number is None or float(heading) > 360):
        yield Finding("error", where, f"the heading is {heading}")
