"""Run every benchmark, one after the other, and write one page: python benchmarks/all.py.

Each room has its own `benchmarks/NAME.py` and page in `benchmarks/results`; they are joined in
`benchmarks/results/all.md`, and the documentation shows the same, always of the newest pages.
`--only NAME...` runs some, `--page` only joins the pages that are there.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

from common import RESULTS, machine

HERE = Path(__file__).resolve().parent
PAGE = RESULTS / "all.md"
#: Helpers, not benchmarks.
_HELPERS = {"all", "common"}


def benchmarks() -> list[Path]:
    """The programs that measure something: those that write a page of their own name."""
    return [
        path
        for path in sorted(HERE.glob("*.py"))
        if path.stem not in _HELPERS and "__main__" in path.read_text(encoding="utf-8")
    ]


def run(programs: list[Path]) -> list[str]:
    """Run programs one at a time, so that none disturbs another; the names that failed."""
    failed = []
    for number, path in enumerate(programs, 1):
        start = time.perf_counter()
        print(f"[{number}/{len(programs)}] {path.name}", file=sys.stderr, flush=True)
        done = subprocess.run([sys.executable, str(path)], cwd=HERE.parent, check=False)
        seconds = time.perf_counter() - start
        if done.returncode:
            failed.append(path.stem)
        state = "failed" if done.returncode else "done"
        print(f"    {state} after {seconds:.0f} s", file=sys.stderr, flush=True)
    return failed


def joined_page(results: Path = RESULTS) -> str:
    """All pages under one heading, each a level down."""
    lines = [
        "# Benchmarks",
        "",
        "Every figure is measured side by side with its peers in one run on one machine; times "
        "are medians. Compare ratios, not seconds: another machine gives other seconds. "
        "Measure them yourself with `make bench`, or one page with `python benchmarks/NAME.py`.",
        "",
    ]
    for path in sorted(results.glob("*.md")):
        if path.stem == "all":
            continue
        fenced = False
        for line in path.read_text(encoding="utf-8").strip().splitlines():
            fenced ^= line.startswith("```")
            lines.append("#" + line if line.startswith("#") and not fenced else line)
        lines += ["", f"Measured by `benchmarks/{path.stem}.py`.", ""]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description="Run the benchmarks and write one page.")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="names without .py")
    parser.add_argument("--page", action="store_true", help="join the pages, run nothing")
    chosen = parser.parse_args()
    programs = [p for p in benchmarks() if not chosen.only or p.stem in chosen.only]
    failed = [] if chosen.page else run(programs)
    RESULTS.mkdir(exist_ok=True)
    PAGE.write_text(joined_page(), encoding="utf-8")
    print(f"{PAGE.relative_to(HERE.parent)}: {len(list(RESULTS.glob('*.md'))) - 1} pages")
    print(machine()[0])
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
