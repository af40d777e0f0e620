"""Run the code blocks of the documentation, in order, as a reader would.

A page's blocks share one folder, which holds `sample_data`, and its Python blocks one
namespace. What a block prints is compared with the block that follows it:

- ``text title="Output"``: the same text, but `...` stands for anything;
- ``text title="For example"``: the same words; numbers may differ.

A block with a file name as its title (``toml title="geofield.toml"``) is written to that
file first, below what an earlier page put there. ``python docs/scripts/blocks.py --update
PAGE...`` writes the outputs anew.

Each page is run in a folder of its own, for a reader who comes straight to it. Who goes through
all of :func:`course` in one folder finds that no page writes what another one wrote; ``--course``
does so.
"""

from __future__ import annotations

import argparse
import contextlib
import doctest
import io
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from orthophoto_server import CHIP_HOST, PUBLIC_ADDRESS, serving

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
COMMAND = (sys.executable, "-m", "geofield")

_FENCE = re.compile(
    r"^(?P<indent> *)```(?P<language>\w+)(?P<info>[^\n]*)\n(?P<body>.*?)^(?P=indent)```[ ]*$",
    re.MULTILINE | re.DOTALL,
)
_TITLE = re.compile(r'title="([^"]*)"')
_OUTPUTS = ("Output", "For example")
#: What stands behind an option or a sign that names a file to write, or between quotes.
_WRITTEN = re.compile(r"(?:--out|-o|>)[ =]([\w./-]+)|[\"']([\w-]+(?:\.\w+|/))[\"']")


@dataclass(frozen=True)
class Block:
    """A fenced block: what it is, what it holds and where it stands in the page."""

    language: str
    title: str
    body: str
    start: int
    end: int
    line: int

    @property
    def is_output(self) -> bool:
        """Whether it shows what the block before it prints."""
        return self.title in _OUTPUTS


class BlockError(Exception):
    """A block failed or printed something else than the page says."""


def read_blocks(text: str) -> list[Block]:
    """All fenced blocks of a page."""
    blocks = []
    for match in _FENCE.finditer(text):
        indent = match["indent"]
        lines = [line.removeprefix(indent) for line in match["body"].splitlines()]
        title = _TITLE.search(match["info"])
        blocks.append(
            Block(
                match["language"],
                title[1] if title else "",
                "\n".join(lines) + "\n",
                match.start("body"),
                match.end("body"),
                text.count("\n", 0, match.start()) + 1,
            )
        )
    return blocks


def pages() -> list[Path]:
    """The pages that have blocks to run."""
    found = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
    return [path for path in found if any(map(_runs, read_blocks(path.read_text("utf-8"))))]


def course() -> list[Path]:
    """Tutorials and how-to pages with blocks to run, in the order of the navigation."""
    named = re.findall(r": ([\w/-]+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.MULTILINE)
    first, runnable = named.index("tutorial.md"), set(pages())
    ordered = [
        DOCS / name for name in named[first:] if "/" not in name or name.startswith("how-to")
    ]
    last = max(at for at, page in enumerate(ordered) if page.parent.name == "how-to")
    return [page for page in ordered[: last + 1] if page in runnable]


def written(page: Path) -> set[str]:
    """Names, without their endings, that the blocks of a page write in their folder.

    `geofield` is not among them: its file of settings grows from page to page.
    """
    blocks = [block.body for block in read_blocks(page.read_text("utf-8")) if not block.is_output]
    found = [name for body in blocks for names in _WRITTEN.findall(body) for name in names]
    return {re.split(r"[./]", name)[0] for name in found} - {"", "geofield"}


def real_data() -> Path | None:
    """The folder of real data beside the project, where there is one."""
    shared = Path(os.environ.get("GEOFIELD_SHARED", ROOT.parent / "shared"))
    return shared if (shared / "data").is_dir() else None


def needs_shared(page: Path) -> bool:
    """Whether a page works on real data, which lie beside the project."""
    text = page.read_text(encoding="utf-8")
    return "../shared" in text or CHIP_HOST in text


def _runs(block: Block) -> bool:
    return block.language in ("python", "bash") and not block.is_output


def prepare(
    folder: Path, shared: Path | None, program: Sequence[str]
) -> tuple[Path, dict[str, str]]:
    """A working folder as a reader's checkout looks, and the environment for its shell."""
    work = folder / "geofield"
    work.mkdir(parents=True)
    (work / "sample_data").symlink_to(ROOT / "sample_data")
    if shared is not None:
        (folder / "shared").symlink_to(shared)
    programs = folder / "bin"
    programs.mkdir()
    command = programs / "geofield"
    command.write_text(f'#!/bin/sh\nexec {shlex.join(program)} "$@"\n')
    command.chmod(0o755)
    environment = dict(os.environ)
    beside = Path(sys.executable).parent  # programs of what is installed with geofield
    environment["PATH"] = os.pathsep.join([str(programs), environment["PATH"], str(beside)])
    environment["PYTHONPATH"] = str(ROOT / "src")
    environment["COLUMNS"] = "100"
    # Tiles of the how-to are kept for the page alone.
    environment["XDG_CACHE_HOME"] = str(folder / "cache")
    return work, environment


def run_pages(
    paths: Iterable[Path],
    folder: Path,
    shared: Path | None = None,
    *,
    update: bool = False,
    program: Sequence[str] = COMMAND,
) -> int:
    """Run the blocks of pages one after another in one folder; the number of blocks run.

    `program` is what the command `geofield` starts.

    Raises
    ------
    BlockError
        Naming the page and the line of the block.
    """
    work, environment = prepare(folder, shared, program)
    with serving(shared) as address:
        addresses = {PUBLIC_ADDRESS: address, CHIP_HOST: address}
        return sum(_run_page(path, work, environment, addresses, update=update) for path in paths)


def _run_page(
    path: Path,
    work: Path,
    environment: dict[str, str],
    addresses: dict[str, str],
    *,
    update: bool,
) -> int:
    """Run a page's blocks, with addresses that stand for those on the page."""
    text = path.read_text(encoding="utf-8")
    blocks = read_blocks(text)
    namespace: dict[str, object] = {"__name__": "__main__"}
    replacements: list[tuple[Block, str]] = []
    count = 0
    for index, shown in enumerate(blocks):
        block = shown
        where = f"{path.relative_to(ROOT)}, line {block.line}"
        for public, loopback in addresses.items():
            block = replace(block, body=block.body.replace(public, loopback))
        if not _runs(block):
            if "." in block.title and not block.is_output:
                with (work / block.title).open("a", encoding="utf-8") as file:
                    file.write(block.body)
            continue
        if block.language == "python":
            printed = _run_python(block, work, namespace, where)
        else:
            printed = _run_shell(block, work, environment, where)
        count += 1
        following = blocks[index + 1] if index + 1 < len(blocks) else None
        if following is not None and following.is_output and not agrees(following, printed):
            if not update:
                raise BlockError(f"{where} prints\n{printed}\nbut the page says\n{following.body}")
            replacements.append((following, printed))
    for block, printed in reversed(replacements):
        body = "".join(line.rstrip() + "\n" for line in printed.strip("\n").splitlines())
        text = text[: block.start] + body + text[block.end :]
    if replacements:
        path.write_text(text, encoding="utf-8")
    return count


def agrees(block: Block, printed: str) -> bool:
    """Whether a program printed what a page shows."""
    want, got = block.body.strip(), printed.strip()
    if block.title == "For example":
        want, got = (re.sub(r"-?\d+(\.\d+)?", "0", part) for part in (want, got))
    options = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    return doctest.OutputChecker().check_output(want + "\n", got + "\n", options)


def _run_python(block: Block, work: Path, namespace: dict[str, object], where: str) -> str:
    printed = io.StringIO()
    # Blank lines put the code at its line of the page, for a traceback that leads there.
    code = compile("\n" * block.line + block.body, where.split(",", maxsplit=1)[0], "exec")
    with contextlib.chdir(work), contextlib.redirect_stdout(printed):
        exec(code, namespace)  # noqa: S102 - the project's own documentation
    return printed.getvalue()


def _run_shell(block: Block, work: Path, environment: dict[str, str], where: str) -> str:
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", block.body],
        cwd=work,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        timeout=300,
    )
    if done.returncode:
        raise BlockError(f"{where} ends with {done.returncode}:\n{done.stdout}")
    return done.stdout


def main() -> int:
    """Run pages from the command line."""
    parser = argparse.ArgumentParser(description="Run the code blocks of documentation pages.")
    parser.add_argument("pages", nargs="*", type=Path)
    parser.add_argument("--update", action="store_true", help="write outputs anew")
    parser.add_argument("--course", action="store_true", help="the whole course in one folder")
    chosen = parser.parse_args()
    real = real_data()
    failed = 0
    if chosen.course:
        rounds = [[page for page in course() if real or not needs_shared(page)]]
    else:
        rounds = [[path.resolve()] for path in chosen.pages] or [[page] for page in pages()]
    for each in rounds:
        with tempfile.TemporaryDirectory() as folder:
            try:
                count = run_pages(each, Path(folder), real, update=chosen.update)
                print(f"{', '.join(str(page.relative_to(ROOT)) for page in each)}: {count} blocks")
            except BlockError as error:
                failed += 1
                print(f"FAILED {error}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
