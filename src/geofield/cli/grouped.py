"""Help of a command with many options: what everyone uses first, the study's own last."""

from __future__ import annotations

import click

from geofield.settings import MODELS

#: Shown first, in this order, by the names that commands give their parameters.
FIRST = (
    "lat",
    "lon",
    "output",
    "out",
    "tracks__spacing_m",
    "tracks__machine",
    "tracks__width_m",
    "name",
    "export__formats",
    "overwrite",
)
STUDY = "The study's method"
#: Titles by section of the settings, in the order of the work.
TITLES = {
    "imagery": "Picture",
    "fetch": "Picture",
    "field": "Outline",
    "obstacles": "Obstacles",
    "tracks": "Tracks",
    "export": "Products",
}

#: Where options belong that are no settings.
BELONGS = {
    "acknowledge_terms": "Picture",
    "boundary": "Outline",
    "boundary_layer": "Outline",
    "boundary_name": "Outline",
    "alternatives": "Outline",
    "choose": "Outline",
    "obstacle_file": "Obstacles",
    "list_regions": STUDY,
    "regions": STUDY,
    "pictures": STUDY,
}


class GroupedCommand(click.Command):
    """A command whose options are listed in groups."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the options by group."""
        groups: dict[str, list[tuple[str, str]]] = {
            title: [] for title in ("Used by everyone", *TITLES.values(), "Further", STUDY)
        }
        # Arguments are told in the text above; click gives some a row without a word.
        options = [each for each in self.get_params(ctx) if isinstance(each, click.Option)]
        for option in sorted(options, key=_rank):
            record = option.get_help_record(ctx)
            if record is not None:
                groups[group_of(option)].append(record)
        for title, rows in groups.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def group_of(parameter: click.Parameter) -> str:
    """The title of the group that a parameter belongs to."""
    name = parameter.name or ""
    if name in FIRST:
        return "Used by everyone"
    section, _, setting = name.partition("__")
    if not setting:
        return BELONGS.get(name, "Further")
    extra = MODELS[section].model_fields[setting].json_schema_extra
    if isinstance(extra, dict) and extra.get("study"):
        return STUDY
    return TITLES[section]


def _rank(parameter: click.Parameter) -> int:
    """First things first; all others keep their order."""
    name = parameter.name or ""
    return FIRST.index(name) if name in FIRST else len(FIRST)
