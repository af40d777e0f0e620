"""What is published: the wheel works alone, and no recipe is behind pyproject.toml."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from pathlib import Path
from typing import Any

import pytest

import geofield

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the sdist as a package index would."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "hatchling", "build", "-d", str(folder)]
    subprocess.run([*build, "-t", "sdist"], cwd=ROOT, check=True, capture_output=True)
    (sdist,) = folder.glob("*.tar.gz")
    source = folder / "source"
    subprocess.run(["tar", "xzf", sdist, "--one-top-level=source"], cwd=folder, check=True)
    (inner,) = source.iterdir()
    subprocess.run([*build, "-t", "wheel"], cwd=inner, check=True, capture_output=True)
    (made,) = folder.glob("*.whl")
    return made


@pytest.mark.slow
def test_the_wheel_does_the_main_job_outside_the_checkout(wheel: Path, tmp_path: Path) -> None:
    home = tmp_path / "environment"
    venv.create(home, with_pip=False)
    site = next((home / "lib").glob("python*/site-packages"))
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    # Its dependencies are those of this environment; its own files are the wheel's alone.
    (site / "dependencies.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    python = home / "bin" / "python"
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    where = subprocess.run(
        [python, "-c", "import geofield; print(geofield.__file__)"],
        cwd=tmp_path,
        env=clean,
        capture_output=True,
        text=True,
        check=True,
    )
    assert Path(where.stdout.strip()).is_relative_to(site)
    place = ["--lat", "35.075373", "--lon", "33.531142", "--spacing", "6"]
    formats = ["--format", "gpkg", "--format", "rdf", "--out", "out"]
    picture = ROOT / "sample_data" / "field_1.tif"
    run: list[Any] = [python, "-m", "geofield", "run", picture, *place, *formats]
    done = subprocess.run(run, cwd=tmp_path, env=clean, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    page: list[Any] = [
        python,
        "-m",
        "geofield",
        "export",
        "out/field.gpkg",
        "-f",
        "html",
        "--out",
        "page",
    ]
    done = subprocess.run(
        page, cwd=tmp_path, env=clean, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_every_file_of_the_package_is_in_the_wheel(wheel: Path) -> None:
    listed = subprocess.run(
        ["git", "ls-files", "src/geofield"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    wanted = {name.removeprefix("src/") for name in listed.stdout.splitlines()}
    with zipfile.ZipFile(wheel) as archive:
        assert wanted <= set(archive.namelist())
        # Of these 14 MB are the network of the outlines.
        assert sum(info.file_size for info in archive.infolist()) < 20_000_000


def test_recipes_say_what_the_project_says() -> None:
    recipe = (ROOT / "packaging" / "conda" / "meta.yaml").read_text()
    block = recipe.split("# run requirements begin")[1].split("# run requirements end")[0]
    conda = {line.strip(" -").replace(" ", "") for line in block.splitlines() if line.strip()}
    names = {"opencv-python-headless": "py-opencv"}
    wanted = set()
    for dependency in PROJECT["dependencies"]:
        name, bound = re.fullmatch(r"([A-Za-z0-9-]+)(.*)", dependency).groups()
        wanted.add(names.get(name, name) + bound.partition(";")[0])
    assert conda == wanted
    for text in (recipe, (ROOT / "CITATION.cff").read_text()):
        assert geofield.__version__ in text


def test_the_release_builds_for_every_python_that_is_promised() -> None:
    workflow = (ROOT / ".github" / "workflows" / "release.yml").read_text()
    promised = [c.split(" :: ")[-1] for c in PROJECT["classifiers"] if "Python :: 3." in c]
    assert promised
    for version in promised:
        assert f'"{version}"' in workflow
    assert "id-token: write" in workflow
    assert "password" not in workflow.replace("no password", "")


@pytest.mark.parametrize(
    "command",
    [
        # Versions of Debian's packages are not pinned: their security updates are wanted.
        ["hadolint", "--ignore", "DL3008", "Containerfile"],
        ["zizmor", "--offline", "--quiet", "--no-progress", ".github/workflows/release.yml"],
    ],
    ids=["Containerfile", "workflow"],
)
def test_linters_are_content(command: list[str]) -> None:
    program = Path(sys.executable).with_name(command[0])
    done = subprocess.run(
        [program, *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
