"""Write what the plugin ships of the engine: its description of itself, and its words in German."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

TARGET = Path(__file__).parent / "geofield_qgis" / "description.json"
SAID = Path(__file__).parents[1] / "src" / "geofield" / "web" / "said.js"
#: Commands that the plugin has a tool for.
COMMANDS = (
    "run", "field", "obstacles", "tracks", "tiles", "export", "import", "validate", "evaluate",
    "batch",
)  # fmt: skip


def described() -> dict[str, Any]:
    """Settings, the commands that the plugin runs, formats, and what all of them may say."""
    geofield = Path(sys.executable).with_name("geofield")

    def ask(command: str) -> Any:
        words = [str(geofield), command, "--json"]
        return json.loads(subprocess.run(words, capture_output=True, check=True).stdout)

    found = ask("settings")
    text = SAID.read_text(encoding="utf-8")
    said = json.loads(text[text.index("{") :].rstrip(";\n"))
    return {
        "settings": found["settings"],
        "commands": {name: found["commands"][name] for name in COMMANDS},
        "formats": [{"name": one["name"], "layers": one["layers"]} for one in ask("formats")],
        "said": {language: rows for language, rows in said.items() if language != "page"},
    }


if __name__ == "__main__":
    text = json.dumps(described(), indent=1, ensure_ascii=False)
    TARGET.write_text(text + "\n", encoding="utf-8")
