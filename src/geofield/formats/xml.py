"""Writing and reading XML files of other people's standards."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

from geofield.errors import FormatError
from geofield.strangers import parse_xml

#: Characters that XML 1.0 has no way to write, not even escaped.
NOT_IN_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")


def node(tag: str, *inside: ET.Element | str | Mapping[str, str], **attributes: str) -> ET.Element:
    """An element: attributes (by name, or as a mapping before those), text and what lies in it."""
    element = ET.Element(tag)
    for each in inside:
        if isinstance(each, str):
            element.text = each
        elif isinstance(each, ET.Element):
            element.append(each)
        else:
            element.attrib.update(each)
    element.attrib.update(attributes)
    return element


def write_xml(root: ET.Element, path: Path) -> None:
    """Write a document as UTF-8; characters that XML cannot carry are refused."""
    for element in root.iter():
        for text in (element.text, *element.attrib.values()):
            if text and (found := NOT_IN_XML.search(text)):
                raise FormatError(
                    f"{path.name}: {text!r} holds the character U+{ord(found.group()):04X}, which "
                    "XML cannot carry.",
                    hint="Remove it from the name.",
                )
    ET.indent(root, " ")
    path.parent.mkdir(parents=True, exist_ok=True)
    tree = ET.ElementTree(root)
    with path.open("wb") as file:
        tree.write(file, encoding="UTF-8", xml_declaration=True, short_empty_elements=True)
        file.write(b"\n")


def read_xml(path: Path) -> ET.Element:
    """The root element of a document; one that is not well-formed, or hostile, is refused."""
    try:
        return parse_xml(path.read_bytes(), path.name)
    except ET.ParseError as error:
        raise FormatError(
            f"{path} is not well-formed XML: {error}.", hint="Is the file whole?"
        ) from error
