"""``geofield live``: tracks at once for another program, for as long as it asks."""

from __future__ import annotations

import json
import sys

import click


@click.command(
    hidden=True,
    epilog="""\b
Example:
  echo '{"do": "plan", "file": "sample_data/field_1.gpkg"}' | geofield live
""",
)
def live() -> None:
    """Answer questions about plans, a line of JSON each, until standard input ends.

    {"do": "plan", "file": PLAN, "obstacles": [...], "outline": "..."} gives the tracks after
    edits that were not saved; {"do": "write", "file": PLAN} plans what lies in the file and
    writes it.
    """
    from geofield.review.live import LivePlans

    plans = LivePlans()
    for line in sys.stdin:
        try:
            question = json.loads(line)
        except ValueError:
            question = {}
        answer = plans.answer(question if isinstance(question, dict) else {})
        click.echo(json.dumps(answer))
