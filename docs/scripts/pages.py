"""The text of the generated pages, from the code that they describe."""

from __future__ import annotations

import base64
import importlib
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from linked_data import ontology_page, queries_page

REPOSITORY_NOTE = "This page is generated from the code it describes."


def generated_pages(root: Path) -> dict[str, str | bytes]:
    """Path in the documentation to content."""
    pages: dict[str, str | bytes] = {
        "reference/cli.md": command_line(),
        "reference/settings.md": settings(),
        "reference/layers.md": layers(),
        "reference/ontology.md": ontology_page(),
        "reference/queries.md": queries_page(),
        "reference/formats.md": formats(),
        "reference/sources.md": sources(),
        "reference/changes.md": changes(root / "CHANGES.md"),
        "benchmarks.md": benchmarks(root / "benchmarks"),
    }
    return pages | notebooks(root / "notebooks")


# --- command line


def command_line() -> str:
    """Every command with its arguments, options and examples."""
    from geofield.cli.main import COMMANDS, cli

    context = click.Context(cli, info_name="geofield")
    rows = [f"| [`{name}`](#geofield-{name}) | {text} |" for name, (_, text) in COMMANDS.items()]
    lines = [
        "# Command line",
        "",
        REPOSITORY_NOTE,
        "",
        "Exit codes: 0 done, 1 the work failed and a message says why, 2 wrong usage. Messages "
        "and progress go to stderr, data (`--json`) to stdout. Angles and positions are named "
        "options. Options that are also settings can stand in a TOML file or in the "
        "environment: see [Settings](settings.md).",
        "",
        "| command | what it does |",
        "| --- | --- |",
        *rows,
        "",
    ]
    for name in COMMANDS:
        command = cli.get_command(context, name)
        if command is not None:
            lines += _command(command, f"geofield {name}", context)
    return "\n".join(lines)


def _command(command: click.Command, name: str, parent: click.Context, level: int = 2) -> list[str]:
    context = click.Context(command, info_name=name.rsplit(maxsplit=1)[-1], parent=parent)
    usage = " ".join([name, *command.collect_usage_pieces(context)])
    lines = [f"{'#' * level} {name}", "", f"```text\n{usage}\n```", ""]
    lines += [_prose(command.help or ""), ""]
    options = [
        record
        for each in command.get_params(context)
        if (record := each.get_help_record(context)) is not None
    ]
    for flags, text in options:
        if text:
            lines += [f"`{flags}`", f":   {_cell(text)}", ""]
    if command.epilog:
        lines += _epilog(command.epilog)
    if isinstance(command, click.Group):
        for sub in command.list_commands(context):
            child = command.get_command(context, sub)
            if child is not None:
                lines += _command(child, f"{name} {sub}", context, level + 1)
    return lines


def _prose(text: str) -> str:
    """Help as click shows it: paragraphs, and blocks that keep their lines."""
    paragraphs = []
    for part in re.split(r"\n\s*\n", text.strip()):
        if part.strip().startswith("\b"):
            body = part.replace("\b", "").strip("\n")
            paragraphs.append(f"```text\n{body}\n```")
        else:
            paragraphs.append(_cell(" ".join(part.split())))
    return "\n\n".join(paragraphs)


def _epilog(text: str) -> list[str]:
    """The examples as code, what stands between them as text."""
    lines: list[str] = []
    code: list[str] = []

    def close() -> None:
        if code:
            lines.extend(["```bash", *code, "```", ""])
            code.clear()

    for line in text.replace("\b", "").strip().splitlines():
        if line.startswith("  ") and not line.lstrip().startswith("`"):
            code.append(line.removeprefix("  "))
        elif line.strip():
            close()
            lines += [f"**{line.strip()}**" if line.rstrip().endswith(":") else _cell(line), ""]
    close()
    return lines


def _cell(text: str) -> str:
    """Text that Markdown must not read as links or HTML."""
    text = " ".join(text.split())
    return text.replace("<", "&lt;").replace("[", "&#91;").replace("|", "&#124;")


# --- settings


def settings() -> str:
    """Every setting with its option, environment variable, default and meaning."""
    from geofield.settings import SECTIONS, Settings

    lines = [
        "# Settings",
        "",
        REPOSITORY_NOTE,
        "",
        "A setting can stand in a TOML file (`--settings FILE`, or `geofield.toml` in the "
        "working folder), in the environment, or on the command line; the later one wins. "
        "The settings of a run travel in its GeoPackage and in `report.json`.",
        "",
        "```toml",
        "[tracks]",
        "spacing_m = 3.0",
        "",
        "[obstacles]",
        "buffer_m = 1.5",
        "```",
        "",
        "The same in the environment: `GEOFIELD_TRACKS__SPACING_M=3`.",
        "",
    ]
    for section in SECTIONS:
        model: Any = Settings.model_fields[section].annotation
        lines += [f"## {section}", "", _cell((model.__doc__ or "").strip()), ""]
        for name, field in model.model_fields.items():
            default = field.get_default()
            shown = "not set" if default is None else json.dumps(default)
            lines += [
                f"`{section}.{name}`",
                f":   {_cell(field.description or '')} Default: `{shown}`.",
                "",
            ]
    return "\n".join(lines)


# --- layers


def layers() -> str:
    """Every layer with its columns, as written to files."""
    from geofield import schema

    lines = [
        "# Layers and columns",
        "",
        REPOSITORY_NOTE,
        "",
        "Lengths, radii and areas are true ground measures in the field's UTM zone. Headings "
        "are degrees clockwise from true north. `x_px`, `y_px` have their origin at the corner "
        "of the picture's top-left pixel, whose centre is (0.5, 0.5). Times are UTC.",
        "",
    ]
    for layer in schema.LAYERS:
        key = ", ".join(f"`{name}`" for name in layer.key)
        note = " Written only when the plan has it." if layer.optional else ""
        lines += [
            f"## {layer.name}",
            "",
            f"{layer.description} Geometry: {layer.geometry}. Key: {key}.{note}",
            "",
            "| column | type | unit | title | meaning | in a Shapefile |",
            "| --- | --- | --- | --- | --- | --- |",
        ]
        for column in layer.columns:
            meaning = schema.meaning(layer, column)
            if column.values:
                meaning += " One of " + ", ".join(f"`{value}`" for value in column.values) + "."
            lines.append(
                f"| `{column.name}` | {column.type} | {schema.unit_in_words(column)} "
                f"| {column.title} | {meaning} | `{column.shapefile}` |"
            )
        lines.append("")
    return "\n".join(lines)


# --- formats, sources


def formats() -> str:
    """Every format: what it carries, what it drops, how exact it is."""
    from geofield.formats import FORMATS

    lines = [
        "# Formats",
        "",
        REPOSITORY_NOTE,
        "",
        "Give these names to `geofield export --format NAME`, `geofield run --format NAME` or "
        "`plan.write(folder, formats=[NAME])`. What a format leaves out of a plan is said when it "
        "is written, and stands in `report.json`.",
        "",
        "| name | format | carries | read back |",
        "| --- | --- | --- | --- |",
    ]
    for name, one in FORMATS.items():
        back = "no" if one.reader is None else "yes"
        lines.append(f"| [`{name}`](#{name}) | {one.title} | {_layer_list(one)} | {back} |")
    for name, one in FORMATS.items():
        lines += ["", f"## {name}", "", f"{one.title}, coordinates in {_crs_words(one.crs)}.", ""]
        lines += ["Files: " + ", ".join(f"`{file}`" for file in one.files) + ".", ""]
        if one.drops:
            lines += ["Leaves out: " + "; ".join(str(drop) for drop in one.drops) + ".", ""]
        if one.precision_m is not None:
            moved = "exactly" if one.precision_m == 0 else f"to {one.precision_m * 1000:g} mm"
            lines += [f"Coordinates come back {moved}.", ""]
        if one.options:
            lines += ["Options: " + ", ".join(f"`{option}`" for option in one.options) + ".", ""]
    return "\n".join(lines)


def _layer_list(one: Any) -> str:
    from geofield import schema

    if len(one.layers) == len(schema.LAYERS):
        return "all layers"
    return ", ".join(one.layers)


def _crs_words(crs: str) -> str:
    return "the field's UTM zone" if crs == "metric" else "longitude and latitude (WGS 84)"


def sources() -> str:
    """The imagery known by name, with its terms."""
    from geofield.imagery.sources.catalogue import BUILTIN

    lines = [
        "# Imagery sources",
        "",
        REPOSITORY_NOTE,
        "",
        "Known by name to `geofield tiles` and `geofield run`. Terms change: follow the address, "
        "you answer for keeping to them. Sources of your own go into the settings file; see "
        "[Use a national orthophoto](../how-to/orthophoto.md).",
        "",
        "| name | imagery | region | licence | to be named | derive geodata | keep tiles |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, one in BUILTIN.items():
        terms = one.terms
        derive = "allowed" if terms.may_derive else "**forbidden**"
        keep = "allowed" if terms.cacheable else "no"
        licence = f"[{terms.licence or 'terms'}]({terms.url})" if terms.url else terms.licence
        lines.append(
            f"| `{name}` | {one.title} | {one.region} | {licence} | {terms.attribution} "
            f"| {derive} | {keep} |"
        )
    return "\n".join([*lines, ""])


# --- changes, benchmarks


def changes(path: Path) -> str:
    """The list of changes as a page."""
    return path.read_text(encoding="utf-8")


def benchmarks(folder: Path) -> str:
    """All measured pages under one heading."""
    sys.path.insert(0, str(folder))
    try:
        joined_page = importlib.import_module("all").joined_page
    finally:
        sys.path.remove(str(folder))
    return str(joined_page(folder / "results"))


# --- notebooks


def notebooks(folder: Path) -> dict[str, str | bytes]:
    """A page per notebook with its code, texts and pictures, and one that lists them."""
    import nbformat

    pages: dict[str, str | bytes] = {}
    lines = [
        "# Notebooks",
        "",
        "Short stories with pictures. Each is a Jupyter notebook of the repository's "
        "`notebooks/` folder, run again by the tests; its outputs are shown as they were "
        "when it was last run.",
        "",
    ]
    for path in sorted(folder.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        title, text, files = _notebook(path.stem, notebook)
        summary = _first_paragraph(notebook)
        lines += [f"**[{title}](notebooks/{path.stem}.md)**  ", f"{summary}", ""]
        pages[f"notebooks/{path.stem}.md"] = text
        pages |= {f"notebooks/{name}": content for name, content in files.items()}
    pages["notebooks.md"] = "\n".join(lines)
    return pages


def _first_paragraph(notebook: Any) -> str:
    for part in notebook.cells[0].source.split("\n\n")[1:]:
        return " ".join(part.split())
    return ""


def _notebook(stem: str, notebook: Any) -> tuple[str, str, dict[str, bytes]]:
    title = notebook.cells[0].source.splitlines()[0].lstrip("# ").strip()
    files: dict[str, bytes] = {}
    lines: list[str] = []
    for index, cell in enumerate(notebook.cells):
        if cell.cell_type == "markdown":
            lines += [cell.source, ""]
            if index == 0:
                lines += [f"The notebook itself: `notebooks/{stem}.ipynb`.", ""]
            continue
        if "hide" in cell.metadata.get("tags", []):
            lines += ['??? note "The code of this step"', ""]
            lines += [f"    {line}".rstrip() for line in _fence(cell.source, "python")] + [""]
        else:
            lines += [*_fence(cell.source, "python"), ""]
        for number, output in enumerate(cell.get("outputs", [])):
            lines += list(_output(output, f"{stem}_{index}_{number}", files))
    return title, "\n".join(lines), files


def _output(output: Any, name: str, files: dict[str, bytes]) -> Iterator[str]:
    if output.output_type == "stream":
        yield from [*_fence(output.text.rstrip(), "text"), ""]
        return
    data = output.get("data", {})
    for kind, ending in (("image/png", "png"), ("image/jpeg", "jpg")):
        if kind in data:
            files[f"{name}.{ending}"] = base64.b64decode(data[kind])
            yield from [f"![Output of the step above]({name}.{ending})", ""]
            return
    if "text/markdown" in data:
        yield from [data["text/markdown"], ""]
    elif "text/plain" in data:
        yield from [*_fence(data["text/plain"], "text"), ""]


def _fence(text: str, language: str) -> list[str]:
    mark = "```" if "```" not in text else "~~~~"
    return [f"{mark}{language}", *text.splitlines(), mark]
