"""What the page may ask for: one session on one file, told in plain JSON values.

The desk knows no HTTP. Each method takes and returns JSON values; a :class:`GeofieldError` says
in words why something was refused, and nothing has changed then.
"""

from __future__ import annotations

import os
import secrets
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import shapely

from geofield.crs import ground_scale_of
from geofield.errors import ChangedError, FormatError, GeofieldError
from geofield.imagery.display import TiledPicture
from geofield.model.scene import Scene
from geofield.notes import listening
from geofield.plan import Plan, read_plan
from geofield.plan_files import tracks_unread
from geofield.review.commands import Command
from geofield.review.ground import Ground
from geofield.review.journal import Journal, fingerprint, play
from geofield.review.refit import noted
from geofield.review.session import Session, Step
from geofield.review.shown import state_of, tracks_of
from geofield.settings import DirectionName, Settings
from geofield.staging import refuse_locked
from geofield.theme import web_theme
from geofield.web.view import margin_bounds, place_table
from geofield.windows import scene_of_plan

#: Bytes of a plan's name: 255 are allowed, and its notes and copies have longer ones.
_LONGEST_NAME = 220


class Desk:
    """A plan, from a GeoPackage of geofield, on the desk.

    Below it the `picture` is shown; where none is given that which was `found`, or lies beside the
    plan. Of that it is told when it cannot be shown.
    """

    def __init__(
        self, path: Path, picture: Path | None = None, *, found: Path | None = None
    ) -> None:
        self.path = path
        self.lock = threading.RLock()
        self._picture_given = picture is not None
        self._picture_path = picture or found or picture_beside(path)
        self._read()

    def _read(self, *, again: bool = False) -> None:
        # What cannot be read is refused before the journal forgets what is not of this file.
        seen, plan = self._read_plan()
        picture, unshown = self._opened(plan)
        journal = Journal(self.path, plan, is_own=again)
        if journal.begins_at != self.path:
            plan = read_plan(journal.begins_at)
        ground = None if self._picture_path is None else Ground(self._scene_of)
        session = Session(plan, ground)
        self.brought_back = journal.replay(session)
        unplanned = None
        if session.plan.tracks is None and session.unplanned is not None:
            unplanned = (
                "There are no tracks for this outline: draw it anew, or change the settings. "
                f"{session.unplanned.message}"
            )
        elif self.brought_back is None and session.outdated:
            self.brought_back = (
                "Field, obstacles or tracks were edited after the tracks had been planned; the "
                "tracks here are planned anew, with what you changed of them. Save them."
            )
        unread = tracks_unread(self.path)
        if unread is not None:
            unread = (
                f"{self.path.name} {unread}: the tracks here are planned anew, and to save "
                "replaces those in the file."
            )
        misnamed = None
        if self.path.suffix != ".gpkg":
            misnamed = (
                f"{self.path.name} is not named as a plan, NAME.gpkg: save under another name."
            )
        told = filter(None, [self.brought_back, unplanned, misnamed, unread, unshown])
        self.brought_back = " ".join(told) or None
        self.seen, self.journal, self.session, self.picture = seen, journal, session, picture
        #: Tells this reading of file and picture from every other one.
        self.reading = secrets.token_hex(4)
        self._edits = 0
        #: The state that was written under another name, and that name.
        self._elsewhere: tuple[Step, str] | None = None
        #: Whether edits were neither saved nor noted when the session ended.
        self.lost = False

    def _opened(self, plan: Plan) -> tuple[TiledPicture | None, str | None]:
        """The picture, and why it shows nothing or there is none."""
        path = self._picture_path
        if path is None:
            lost = "The picture of this plan is not beside it; --picture shows one."
            return None, lost if plan.field.imagery else None
        try:
            picture = TiledPicture.open(path, plan.field.crs, plan.point)
            shows = picture.has_data(plan.field.polygon.bounds)
        except GeofieldError as error:
            if self._picture_given:
                raise
            return None, f"The picture is not shown: {error}"
        # The map ends where its picture does: on one of another place there would be no field.
        if not shapely.box(*picture.bounds).intersects(plan.field.polygon):
            return (
                None,
                f"The picture is not shown: {path.name} is of another place than this field.",
            )
        if not shows:
            return picture, f"The picture {path.name} holds no data at this field."
        return picture, None

    def _read_plan(self) -> tuple[str, Plan]:
        """The version of the file, and the plan in it.

        Reading itself makes another version of a file whose write-ahead log was left by a crash: it
        is folded in.
        """
        seen, plan = self._fingerprint(), read_plan(self.path)
        now = self._fingerprint()
        return (seen, plan) if now == seen else (now, read_plan(self.path))

    @property
    def stamp(self) -> str:
        """What tells the state that is shown from every other one."""
        return f"{self.reading}.{self._edits}"

    # -- what the page asks ------------------------------------------------------------------

    def opening(self) -> dict[str, Any]:
        """The session's state and what does not change: picture, file, places."""
        from geofield.formats import FORMATS

        with self.lock:
            plan = self.session.plan
            picture = self.picture
            bounds = margin_bounds(plan.field.polygon) if picture is None else picture.bounds
            return {
                **self._state(),
                "file": self.path.name,
                "brought_back": self.brought_back,
                "bounds": bounds,
                "places": place_table(plan.field.crs, bounds),
                "picture": self._picture_facts(),
                "scale": 1.0 / float(ground_scale_of(plan.field.polygon, plan.field.crs)),
                "theme": web_theme(),
                # A plan is saved under another name: there is one way to have a second one.
                "formats": [
                    (one.name, one.title) for one in FORMATS.values() if one.name != "gpkg"
                ],
                "directions": get_args(DirectionName),
            }

    def edit(self, command: Command) -> dict[str, Any]:
        """Make an edit, undo or redo, and note it in the journal."""
        with self.lock:
            before = self.session.step
            play(self.session, command)
            if self.session.step is not before:
                self._edits += 1
                self.journal.write(noted(before.plan, command))
            return self._state()

    def preview(self, command: Command) -> dict[str, Any]:
        """The tracks that an edit would lead to."""
        return tracks_of(self.session.preview(command))

    def save(self, target: str | None = None) -> dict[str, Any]:
        """Write the plan into its file, or under another name beside it.

        Raises
        ------
        ChangedError
            When another program changed the file since it was read.
        FormatError
            When it is locked or cannot be written.
        """
        from geofield.plan_files import save_plan

        with self.lock:
            if target is not None:
                # Whatever other programs do to the plan's own file, this one comes into being.
                place, step = self._beside(target), self.session.whole()
                with _in_words(place):
                    save_plan(step.plan, place, picture=self._picture_path)
                self._elsewhere = step, place.name
                return {**self._state(), "saved_as": place.name}
            if self._fingerprint() != self.seen:
                raise ChangedError(
                    f"Another program changed {self.path.name} since it was opened here.",
                    hint="Reload it (edits made here are made again where they fit), or save your "
                    "edits under another name (see More).",
                )
            if not self.session.edited:  # the one before it stays the one that can be brought back
                return {**self._state(), "saved_as": self.path.name}
            refuse_locked(self.path)
            step = self.session.whole()
            with _in_words(self.path):
                self.journal.before_saving()
                save_plan(step.plan, self.path, read_from=self.path)
            self.seen = fingerprint(self.path)
            self.session.mark_saved(step)
            self.journal.saved()
            if self.journal.refused:
                # What led here is noted nowhere: a kill must not bring back half of it.
                self.journal.clear()
                self.session.forget()
            return {**self._state(), "saved_as": self.path.name}

    def reload(self) -> dict[str, Any]:
        """Read the file again; edits that were not saved are kept beside it."""
        with self.lock:
            self.refuse_loss()
            self._read(again=True)
            return self.opening()

    def refuse_loss(self) -> None:
        """Refuse to leave edits that lie nowhere on the disk.

        Raises
        ------
        FormatError
        """
        self.journal.flush()
        if self.journal.refused and self._saved_elsewhere is None:
            raise FormatError(
                f"Edits could not be noted on the disk ({self.journal.refused}) and would be lost.",
                hint="Save them, here or under another name (see More).",
            )

    def export(self, name: str) -> dict[str, Any]:
        """Write the plan as edited in another format, into a folder of its own beside it."""
        from geofield.formats import FORMATS, format_named, write_dataset
        from geofield.imagery import write_scene

        exports, stem = self._exports()
        chosen = format_named(name)
        alike = (one.name for one in FORMATS.values() if set(one.files) & set(chosen.files))
        # Of formats with the same names all but the first have a folder: none replaces another.
        folder = exports if next(alike) == chosen.name else exports / chosen.name
        with (
            self.lock,
            tempfile.TemporaryDirectory(prefix="geofield-") as place,
            listening() as heard,
        ):
            dataset = self.session.whole().plan.to_dataset()
            scene = picture_beside(self.path)
            if chosen.pictured and self._picture_path not in (None, scene):
                cut = self._scene_of(self.session.plan)
                scene = write_scene(cut, Path(place) / "scene.tif")
            dataset = replace(dataset, scene_path=scene)
            written = write_dataset(
                dataset, folder, [name], stem=stem, overwrite=True, inputs=[self.path]
            )
            state = self._state()  # the route is planned now, if it waited
        within = Path(*exports.parts[-2:])
        made = dict.fromkeys(str(within / path.relative_to(exports).parts[0]) for path in written)
        return {"files": list(made), "notes": [str(one) for one in heard], "state": state}

    def _exports(self) -> tuple[Path, str]:
        """The folder of exports, one for each plan as their names are the same, and their stem."""
        return self.path.parent / "export" / self.path.stem, self.path.stem

    def _scene_of(self, plan: Plan) -> Scene:
        """The picture around the field, as the plan's own run read it."""
        return scene_of_plan(str(self._picture_path), plan, plan.settings or Settings())

    def end(self) -> str | None:
        """Leave nothing behind but edits that were not saved; where those are, in words."""
        if not self.session.edited or self.journal.is_empty:
            self.journal.clear()
            return None
        self.journal.flush()
        if self.journal.refused:
            if self._saved_elsewhere is not None:
                return f"Edits of {self.path} were saved as {self._saved_elsewhere}."
            self.lost = True
            return f"Edits of {self.path} are lost: {self.journal.refused}."
        return f"Edits that were not saved lie in {self.journal.path}; the next session has them."

    # -- inner -------------------------------------------------------------------------------

    @property
    def _saved_elsewhere(self) -> str | None:
        """The name under which the state that is shown was written, if it was."""
        step, name = self._elsewhere or (None, None)
        return name if step is self.session.step else None

    def _state(self) -> dict[str, Any]:
        return {
            **state_of(self.session),
            "unnoted": self.journal.refused,
            "stamp": self.stamp,
        }

    def _fingerprint(self) -> str:
        try:
            return fingerprint(self.path)
        except FileNotFoundError:
            raise FormatError(
                f"{self.path.name} is not there any more: another program moved or deleted it.",
                hint="Save your edits under another name, or put the file back.",
            ) from None

    def _beside(self, name: str) -> Path:
        """A new file in the plan's folder: the page names no other folder."""
        if not name or Path(name).name != name or name.startswith("."):
            raise FormatError(f"{name!r} is no plain file name.")
        place = self.path.with_name(f"{name.removesuffix('.gpkg')}.gpkg")
        if len(os.fsencode(place.name)) > _LONGEST_NAME:
            raise FormatError("That name is too long for a file.", hint="Choose another name.")
        if place.exists():
            raise FormatError(f"{place.name} is there already.", hint="Choose another name.")
        return place

    def _picture_facts(self) -> Mapping[str, Any] | None:
        picture = self.picture
        if picture is None:
            return None
        source = picture.reader.source
        return {
            "reading": self.reading,
            "resolutions": picture.resolutions_m,
            "infrared": picture.has_infrared,
            "credit": " · ".join(
                text for text in (source.attribution, source.licence, source.date) if text
            ),
        }


@contextmanager
def _in_words(path: Path) -> Iterator[None]:
    """What the disk has against writing a file, in words."""
    try:
        yield
    except OSError as error:
        raise FormatError(
            f"{path.name} could not be written: {error.strerror or error}.",
            hint="The edits are kept; make room, or save under another name.",
        ) from error


def picture_beside(path: Path) -> Path | None:
    """The picture that a run left beside its plan."""
    from geofield.formats.gpkg_read import scene_beside

    try:
        return scene_beside(path)
    except GeofieldError:
        return None
