"""Bring the translators' files up to date: every text of the plugin, with what is translated.

python plugin/translate.py de fr ...    makes or refreshes geofield_de.ts, geofield_fr.ts
"""

from __future__ import annotations

import ast
import json
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

PLUGIN = Path(__file__).parent / "geofield_qgis"
# The module alone: the package needs QGIS.
sys.path.insert(0, str(PLUGIN))
import description  # noqa: E402

from geofield import schema  # noqa: E402
from geofield.formats.qgis.looks import LOOKS  # noqa: E402


def texts() -> dict[str, str]:
    """Every text that a person may read, and the file that shows it."""
    found: dict[str, str] = {}
    for file in sorted(PLUGIN.glob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            for text in _texts_of(node):
                found.setdefault(text, file.name)
    described = json.loads((PLUGIN / "description.json").read_text(encoding="utf-8"))
    rows = list(described["settings"])
    for name, command in described["commands"].items():
        found |= dict.fromkeys(description.command_help(name), "description.json")
        rows += [row for row in command["parameters"] if "name" in row]
    for row in rows:
        # Labels are read in the window, as the texts of the code are.
        found.setdefault(description.label_of(row), "description.py")
        if row["description"]:
            found.setdefault(row["description"], "description.json")
    for layer in (*schema.LAYERS, schema.PLACES):
        for text in (layer.title, *(rule.label for rule in LOOKS[layer.name].rules)):
            found.setdefault(text, "results.py")
    return found


def refresh(language: str) -> tuple[int, int]:
    """Write a language's file; returns how many texts it has, and how many are translated."""
    file = PLUGIN / "i18n" / f"geofield_{language}.ts"
    known = translated(file)
    root = ET.Element("TS", version="2.1", language=language, sourcelanguage="en")
    context = ET.SubElement(root, "context")
    ET.SubElement(context, "name").text = "geofield"
    for text, place in texts().items():
        message = ET.SubElement(context, "message")
        ET.SubElement(message, "location", filename=place)
        ET.SubElement(message, "source").text = text
        target = ET.SubElement(message, "translation")
        if text in known:
            target.text = known[text]
        else:
            target.set("type", "unfinished")
    ET.indent(root)
    body = ET.tostring(root, encoding="unicode")
    file.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE TS>\n{body}\n', "utf-8")
    return len(texts()), sum(text in known for text in texts())


def translated(file: Path) -> dict[str, str]:
    """The translations that a file has."""
    if not file.is_file():
        return {}
    root = ET.parse(file).getroot()
    pairs = [
        (each.findtext("source"), each.findtext("translation")) for each in root.iter("message")
    ]
    return {source: target for source, target in pairs if source and target}


def _texts_of(node: ast.AST) -> list[str]:
    """Texts given to `tr`, and the titles and groups of the algorithms."""
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "tr":
        return [each.value for each in node.args if isinstance(each, ast.Constant)]
    if isinstance(node, ast.Assign):
        names = [name for target in node.targets for name in _names(target)]
        if names and set(names) <= {"identifier", "title", "section", "command"}:
            values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
            return [
                each.value
                for name, each in zip(names, values, strict=False)
                if name == "title" and isinstance(each, ast.Constant) and each.value
            ]
        if names in (["FIELD"], ["STAGES"], ["FILES"]) and isinstance(node.value, ast.Tuple):
            return [node.value.elts[1].value]
    return []


def _names(target: ast.AST) -> list[str]:
    if isinstance(target, ast.Tuple):
        return [name for each in target.elts for name in _names(each)]
    return [target.id] if isinstance(target, ast.Name) else []


if __name__ == "__main__":
    for each in sys.argv[1:] or ["de"]:
        count, done = refresh(each)
        print(f"{each}: {count} texts, {done} translated")
