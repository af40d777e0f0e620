"""The zip that `make plugin` builds, by the rules of the plugin site."""

from __future__ import annotations

import ast
import configparser
import hashlib
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from plugin_place import PLUGINS, ROOT

from told_notes import notes_of_tracks

sys.path.insert(0, str(PLUGINS))
import translate

import geofield

FOLDER = PLUGINS / "geofield_qgis"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, PLUGINS / "package.py", folder], check=True, cwd=ROOT)
    (path,) = folder.glob("*.zip")
    return path


def test_the_zip_is_what_the_site_accepts(built):
    assert built.stat().st_size < 1_000_000
    with zipfile.ZipFile(built) as archive:
        names = archive.namelist()
        assert {name.split("/")[0] for name in names} == {"geofield_qgis"}
        assert {"geofield_qgis/LICENSE", "geofield_qgis/metadata.txt"} <= set(names)
        for name in names:
            archive.read(name).decode("utf-8")  # text alone, no binaries
        licence = archive.read("geofield_qgis/LICENSE").decode()
    assert "GNU GENERAL PUBLIC LICENSE" in licence
    assert "Version 2, June 1991" in licence


def test_metadata_is_complete(built):
    metadata = configparser.ConfigParser(interpolation=None)
    with zipfile.ZipFile(built) as archive:
        metadata.read_string(archive.read("geofield_qgis/metadata.txt").decode())
    general = metadata["general"]
    for name in (
        "name", "qgisMinimumVersion", "description", "about", "version", "author", "email",
        "repository", "tracker", "license", "tags", "icon",
    ):  # fmt: skip
        assert general[name], name
    assert general["qgisMinimumVersion"] == "3.22"
    assert general["hasProcessingProvider"] == "yes"
    assert general["version"] == geofield.__version__
    assert (FOLDER / general["icon"]).is_file()


def test_every_file_that_is_installed_is_named_by_its_hash(built):
    (wheel,) = built.parent.glob("geofield-*.whl")
    with zipfile.ZipFile(built) as archive:
        text = archive.read("geofield_qgis/requirements.txt").decode()
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    assert f"geofield=={geofield.__version__} \\\n    --hash=sha256:{digest}" in text
    named = re.split(r"\n(?=\S)", re.sub(r"(?m)^\s*#.*\n", "", text))
    assert all("--hash=sha256:" in each for each in named if "==" in each)
    assert sum("==" in each for each in named) > 20


def test_qt_comes_from_qgis_and_enumerations_are_scoped():
    """So that the same files run on Qt 5 and Qt 6."""
    for file in sorted(FOLDER.glob("*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            assert not isinstance(node, ast.Assert), f"{file.name}: assert"
            names = []
            if isinstance(node, ast.Import):
                names = [each.name for each in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            for name in names:
                assert not name.startswith(("PyQt", "geofield", "numpy", "subprocess")), name
            # Qt.LeftButton instead of Qt.MouseButton.LeftButton
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id in ("Qt", "QProcess", "QgsWkbTypes", "QStandardPaths")
                and node.attr[0].isupper()
            ):
                parent = [
                    each
                    for each in ast.walk(tree)
                    if isinstance(each, ast.Attribute) and each.value is node
                ]
                assert parent, f"{file.name}: {node.value.id}.{node.attr} has no scope"


def test_the_checks_that_block_on_the_site_find_nothing():
    tools = Path(sys.executable).parent
    done = subprocess.run(
        [tools / "bandit", "-q", "-r", "-f", "json", FOLDER],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert json.loads(done.stdout)["results"] == []
    done = subprocess.run(
        [tools / "detect-secrets", "scan", "--all-files", FOLDER],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert json.loads(done.stdout)["results"] == {}


def test_translations_know_every_text():
    texts = set(translate.texts())
    for file in (FOLDER / "i18n").glob("*.ts"):
        root = translate.ET.parse(file).getroot()
        assert {each.findtext("source") for each in root.iter("message")} == texts, (
            "run: python plugin/translate.py de"
        )
    german = translate.translated(FOLDER / "i18n" / "geofield_de.ts")
    # All that is said in the window; what no dialogue asks for stays English.
    spoken = {text for text, place in translate.texts().items() if place.endswith(".py")}
    assert spoken <= set(german)
    for source, target in german.items():
        gaps = [sorted(re.findall(r"{.*?}", text)) for text in (source, target)]
        assert gaps[0] == gaps[1], source


def test_german_is_spoken(qgis):
    answer = qgis("spoken", language="de")
    assert answer.pop("helped") > 100
    assert answer == {
        "plan": "Ein Feld planen",
        "group": "Schritt für Schritt",
        "label": "Spurabstand (m)",
        "theirs": "%1 [optional]",  # QGIS's own words: they were blank in every dialogue
        "still_english": [],
    }


def test_what_the_engine_says_is_german_as_on_the_review_page(qgis):
    """Doubts, notes and refusals were English in a panel that was German otherwise."""
    notes = notes_of_tracks()
    told = qgis("told", language="de", texts=notes)
    assert [text for text in told if text in notes] == []
    assert "Wege zwischen Abschnitten" in " ".join(told)
    assert re.findall(r"\d+\.\d+", " ".join(told)) == []
    some = {
        "field.2.gpkg is there already.": "field.2.gpkg gibt es schon.",
        "It has 1.5 m. Choose another name.": "It has 1.5 m. Wählen Sie einen anderen Namen.",
        "it is only 1.5 m wide (a way?)": "es ist nur 1,5 m breit (ein Weg, ein Streifen?)",
        "Another tab is editing this plan.": "Another tab is editing this plan.",
    }
    assert dict(zip(some, qgis("told", language="de", texts=list(some)), strict=True)) == some
    assert qgis("told", language="fr", texts=list(some)) == list(some)
