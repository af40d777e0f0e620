"""Write the description that the plugin ships: what the command line says of itself."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

TARGET = Path(__file__).parent / "geofield_qgis" / "description.json"
#: Commands that the plugin has a tool for.
COMMANDS = (
    "run", "field", "obstacles", "tracks", "tiles", "export", "import", "validate", "evaluate",
    "batch",
)  # fmt: skip


def described() -> dict[str, Any]:
    """Settings, the commands that the plugin runs, and formats."""
    geofield = Path(sys.executable).with_name("geofield")

    def ask(command: str) -> Any:
        words = [str(geofield), command, "--json"]
        return json.loads(subprocess.run(words, capture_output=True, check=True).stdout)

    found = ask("settings")
    return {
        "settings": found["settings"],
        "commands": {name: found["commands"][name] for name in COMMANDS},
        "formats": [{"name": one["name"], "layers": one["layers"]} for one in ask("formats")],
    }


if __name__ == "__main__":
    text = json.dumps(described(), indent=1, ensure_ascii=False)
    TARGET.write_text(text + "\n", encoding="utf-8")
