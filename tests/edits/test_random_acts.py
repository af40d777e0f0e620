"""What a person said stands through random sequences of edits and commands.

A model of its own keeps what was said; the files are read without geofield. A sequence that fails
is told with its seed.
"""

from __future__ import annotations

import random
import sqlite3
from collections.abc import Callable
from contextlib import closing
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from changed_plans import Frame, geofield, run
from shapely import Point
from shapely.affinity import scale, translate

from geofield.simulate import SimulatedField

FREE = ("rejected", "possible")


@dataclass
class Said:
    """What a person said of an obstacle; NaN as radius where it is no circle."""

    shape: Any
    status: str
    radius_m: float


@dataclass
class Truth:
    """All that a person said, by their own account."""

    said: dict[int, Said] = field(default_factory=dict)
    #: Drawn since the last command, which gives them their numbers.
    drawn: list[Said] = field(default_factory=list)
    gone: list[Any] = field(default_factory=list)
    noted: set[int] = field(default_factory=set)
    outline: Any = None
    tracks_gone: list[Any] = field(default_factory=list)


class Play:
    """One plan, the model of what was said of it, and the acts on both."""

    def __init__(self, folder: Path, made: SimulatedField, seed: int) -> None:
        self.folder, self.made, self.random = folder, made, random.Random(seed)
        self.file, self.truth, self.did = folder / "out/field.gpkg", Truth(), [f"seed {seed}"]
        self.numbers = set(self.table("obstacles")["obstacle_no"])
        self.before: tuple[list[str], Truth] | None = None

    def table(self, layer: str) -> Frame:
        return gpd.read_file(self.file, layer=layer)

    def save(self, layer: str, table: Frame) -> None:
        table.to_file(self.file, layer=layer, driver="GPKG", geometry_name="geom")

    def dump(self) -> list[str]:
        with closing(sqlite3.connect(self.file)) as connection:
            return list(connection.iterdump())

    def place(self) -> Any:
        inner = self.table("field").geometry.iloc[0].buffer(-12)
        west, south, east, north = inner.bounds
        while True:
            spot = Point(self.random.uniform(west, east), self.random.uniform(south, north))
            if inner.covers(spot):
                return spot

    def drawn(self) -> Any:
        """A shape in the field, which is not round."""
        return scale(self.place().buffer(self.random.uniform(2, 5), quad_segs=2), 1, 0.6)

    def one(self) -> tuple[Frame, Any, int, Said]:
        """A row of the obstacles, and what is known of it."""
        table = self.table("obstacles")
        row = self.random.choice(table.index[table["obstacle_no"].notna()].tolist())
        number = int(table.at[row, "obstacle_no"])
        found = Said(*table.loc[row, ["geometry", "status", "radius_m"]])
        return table, row, number, self.truth.said.get(number, found)

    def changed(self, number: int, known: Said) -> None:
        if number not in self.truth.said and known.status in ("detected", "possible"):
            known.status = "confirmed"
        self.truth.said[number] = known

    def status(self) -> None:
        table, row, number, known = self.one()
        known.status = self.random.choice([w for w in ("confirmed", *FREE) if w != known.status])
        table.at[row, "status"] = known.status
        self.save("obstacles", table)
        self.truth.said[number] = known

    def move(self) -> None:
        table, row, number, known = self.one()
        step = self.random.uniform(-20, 20), self.random.uniform(-20, 20)
        old, known.shape = known.shape, translate(known.shape, *step)
        if self.random.random() < 0.4:
            known.shape, known.radius_m = self.drawn(), np.nan
        table.at[row, "geometry"] = known.shape
        self.save("obstacles", table)
        # Where something stands now it is that which was there.
        stands = [known.shape, *table.geometry.drop(row)]
        if not any(one.covers(old.centroid) or old.covers(one.centroid) for one in stands):
            self.truth.gone.append(old)
        self.changed(number, known)

    def delete(self) -> None:
        table, row, number, known = self.one()
        self.save("obstacles", table.drop(row))
        self.truth.gone.append(known.shape)
        self.truth.said.pop(number, None)

    def note(self) -> None:
        table = self.table("obstacles")
        self.save("obstacles", table.assign(note=table["obstacle_no"]))
        self.truth.noted = set(table["obstacle_no"].dropna())

    def draw(self) -> None:
        known = Said(self.drawn(), "added", np.nan)
        table = self.table("obstacles")
        row = gpd.GeoDataFrame(geometry=[known.shape], crs=table.crs)
        self.save("obstacles", pd.concat([table, row]))
        self.truth.drawn.append(known)

    def outline(self) -> None:
        table = self.table("field")
        shape = table.geometry.iloc[0].buffer(self.random.uniform(-2, 1), join_style="mitre")
        self.save("field", table.set_geometry([shape], crs=table.crs))
        self.truth.outline = shape

    def shuffle(self) -> None:
        table = self.table("obstacles")
        self.save("obstacles", table[::-1].to_crs(3857).to_crs(table.crs))

    def drop_track(self) -> None:
        if self.has_tracks:
            table = self.table(layer := self.random.choice(["tracks", "segments"]))
            number = self.random.choice(table["track_no"].tolist())
            mine = table["track_no"] == number
            self.save(layer, table[~mine])
            self.truth.tracks_gone.append(table[mine].union_all().buffer(0.02))

    @property
    def has_tracks(self) -> bool:
        there = set(gpd.list_layers(self.file)["name"])
        return "segments" in there and len(self.table("segments")) > 3

    def command(self) -> None:
        picture, out, file = self.folder / "picture.tif", self.folder / "x", self.file
        tracks = "tracks", file, "-o", file
        there = "export", file, "-f", "geoparquet", "--out", out, "--overwrite"
        back = "import", out / "geoparquet", "-o", file, "--overwrite"
        stages: dict[str, Callable[[], Any]] = {
            "tracks": lambda: geofield(*tracks),
            "obstacles": lambda: geofield("obstacles", picture, file, "-o", file),
            "run": lambda: run(self.folder, self.made, "--overwrite"),
            # Through a format that leaves nothing out.
            "there and back": lambda: [geofield(*each) for each in (there, back, tracks)],
        }
        self.did.append(stage := self.random.choice([*stages, "tracks"]))
        self.replace(stages[stage])
        if self.random.random() < 0.3:
            once = {name: self.table(name) for name in ("field", "obstacles")}
            self.replace(stages[stage])
            for name, table in once.items():
                pd.testing.assert_frame_equal(self.table(name), table, rtol=0, atol=1e-3)

    def replace(self, stage: Callable[[], Any]) -> None:
        before = self.dump(), deepcopy(self.truth)
        stage()
        # Of several commands in a row `undo` takes back the last.
        self.before = None if self.did[-1] == "there and back" else before
        self.check()

    def undo(self) -> None:
        if self.before is not None:
            now = self.dump(), self.truth
            geofield("undo", self.file)
            assert self.dump() == self.before[0], "undo brings another plan back"
            self.truth, self.before = self.before[1], now

    def check(self) -> None:
        rows, truth = self.table("obstacles").set_index("obstacle_no"), self.truth
        assert rows.index.is_unique
        for known in truth.drawn:
            same = shapely.hausdorff_distance(rows.geometry, known.shape) < 0.003
            (number,) = set(rows.index[same]) - truth.said.keys()
            truth.said[number] = known
        truth.drawn = []
        for number, known in truth.said.items():
            assert number in rows.index, f"obstacle {number} is gone"
            row = rows.loc[number]
            assert row["status"] == known.status, f"status of {number}"
            assert row.geometry.hausdorff_distance(known.shape) < 0.003, f"shape of {number}"
            assert row["radius_m"] == pytest.approx(known.radius_m, abs=0.01, nan_ok=True), number
            assert number not in truth.noted or row["note"] == number, f"note of {number}"
        others = rows[~rows.index.isin(list(truth.said))]
        assert others["status"].isin(["detected", "possible"]).all()
        rejected = [each.shape for each in truth.said.values() if each.status == "rejected"]
        for number in set(others.index) - self.numbers:
            shape = others.geometry[number]
            for away in (*truth.gone, *rejected):
                assert shape.intersection(away).area < shape.area / 2, f"{number} came back"
        self.numbers = set(rows.index)
        shape = self.table("field").geometry.iloc[0]
        if truth.outline is not None:
            assert shape.hausdorff_distance(truth.outline) < 0.003, "the outline is another"
        if self.has_tracks:
            self.check_tracks(shape, rows)

    def check_tracks(self, field_shape: Any, rows: Frame) -> None:
        lines = self.table("segments").union_all()
        stands = rows[~rows["status"].isin(FREE)].union_all()
        assert lines.intersection(stands.buffer(-0.02)).length < 0.01, "through an obstacle"
        assert lines.difference(field_shape.buffer(0.01)).length < 0.01, "out of the field"
        free = set(rows.index[rows["status"].isin(FREE)])
        assert free.isdisjoint(self.table("gaps")["obstacle_no"]), "around what is no obstacle"
        for away in self.truth.tracks_gone:
            assert lines.intersection(away).length < 1, "a track that was taken away is driven"


EDITS = ("status", "move", "delete", "draw", "note", "outline", "shuffle", "drop_track")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_was_said_stands_whatever_comes_next(
    folder: Path, made: SimulatedField, seed: int
) -> None:
    play = Play(folder, made, seed)
    try:
        for _ in range(14):
            name = play.random.choice([*EDITS, "status", "move", *["command"] * 6, "undo"])
            play.did.append(name)
            getattr(play, name)()
        play.did.append("command")
        play.command()
    except AssertionError as fault:
        raise AssertionError(f"{fault}; after {', '.join(play.did)}") from fault
