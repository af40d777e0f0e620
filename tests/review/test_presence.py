"""A second review of a plan knows whether the first one still runs."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from geofield.plan import read_plan
from geofield.plan_files import save_plan
from geofield.review.desk import Desk
from geofield.review.plans import journal_path
from geofield.review.presence import is_open_elsewhere

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no such locks")

FIRST = """
import sys
from pathlib import Path
from geofield.review.desk import Desk
desk = Desk(Path(sys.argv[1]))
for number in sys.argv[2].split():
    desk.edit({"do": "status", "no": int(number), "status": "rejected"})
print("edited", flush=True)
sys.stdin.read()
"""


@contextmanager
def first_review(plan_path: Path, numbers: str) -> Iterator[None]:
    """Another process that reviews the plan; killed in the end."""
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", FIRST, str(plan_path), numbers]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "edited\n"
            yield
        finally:
            process.kill()


def test_a_living_session_has_not_ended(plan_path: Path) -> None:
    with first_review(plan_path, "3 4"):
        assert is_open_elsewhere(journal_path(plan_path))
        second = Desk(plan_path)
        assert second.brought_back is not None
        assert second.brought_back.startswith(
            "Another review of this plan is open: what it did not save (2 edits) is here, too."
        )
        assert second.session.plan.obstacles is not None
        assert second.session.plan.obstacles["status"].eq("rejected").sum() == 2


def test_a_killed_session_has_ended(plan_path: Path) -> None:
    with first_review(plan_path, "3"):
        pass
    assert not is_open_elsewhere(journal_path(plan_path))
    told = "1 edit of a session that ended without saving was brought back."
    assert Desk(plan_path).brought_back == told


def test_what_was_noted_on_another_version_is_told_of_a_living_session(plan_path: Path) -> None:
    with first_review(plan_path, "3"):
        plan = read_plan(plan_path)
        assert plan.obstacles is not None
        plan.obstacles.loc[plan.obstacles.index[-1], "status"] = "confirmed"
        save_plan(plan, plan_path, read_from=plan_path)
        told = Desk(plan_path).brought_back
        assert told == (
            "The plan was changed since another review of it, which is still open, noted its "
            "edits: 1 of its 1 edit was made again."
        )
