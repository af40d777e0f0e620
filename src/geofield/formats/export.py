"""Writing products: stage, say what is dropped, move into place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from geofield import schema
from geofield.errors import FormatError, FormatWarning
from geofield.formats.clear_way import tell_blocked
from geofield.formats.edited import made_whole
from geofield.formats.gpkg_guests import replace_plan
from geofield.formats.many import distinct, field_ids, joined
from geofield.formats.names import safe_name
from geofield.formats.registry import FORMATS, Format, format_named
from geofield.formats.terminal import main_field
from geofield.model import Dataset
from geofield.model.obstacles import active
from geofield.notes import warn
from geofield.staging import staged_folder
from geofield.wording import nearest

#: Options that are true or false, and how a person writes that.
_TRUTHS = {"zip", "points", "project", "picture"}
_YES, _NO = ("yes", "true", "on", "1"), ("no", "false", "off", "0", "none", "")


def write_dataset(
    dataset: Dataset, folder: Path | str, formats: Iterable[str], **how: Any
) -> list[Path]:
    """Write one dataset: :func:`write_datasets` of it alone.

    Further arguments, warnings and errors are those of :func:`write_datasets`.
    """
    return write_datasets([dataset], folder, formats, **how)


def write_datasets(
    datasets: Sequence[Dataset],
    folder: Path | str,
    formats: Iterable[str],
    *,
    stem: str = "field",
    overwrite: bool = False,
    options: Mapping[str, Any] | None = None,
    inputs: Iterable[Path | str] = (),
    tell_drops: bool = True,
) -> list[Path]:
    """Write the datasets of one or more fields in one or more formats.

    Either all products come into place or none; previous ones stay as they were until then.
    Formats that hold several fields get all of them; of the others each field has its own
    products, named after it or in a folder that is. What a person changed is made whole first.

    Parameters
    ----------
    datasets : sequence of Dataset
        At least one.
    folder : Path
        Where the products go; made when it is missing.
    formats : iterable of str
        Names of the registry.
    stem : str
        Name of the products that are one file.
    overwrite : bool
        Whether products that are there already may be replaced; a GeoPackage stays beside the new
        one as ``.bak``, and what a person keeps in it comes along. Files of layers that a product
        has no more go.
    options : mapping, optional
        Options of the writers (see `Format.options`); each writer gets those it knows. Under
        a format's name stands a mapping of options for it alone.
    inputs : iterable of Path
        Files that were read for this dataset: they are never replaced.
    tell_drops : bool
        Warn of what a format cannot carry; False where the caller tells it another way.

    Returns
    -------
    list of Path
        What was written.

    Warns
    -----
    FormatWarning
        Once per format that drops something the dataset has.
    TrackWarning
        In other formats, of such tracks.

    Raises
    ------
    FormatError
        For an unknown format or option, and when a product cannot be written.
    TrackError
        When a machine would be steered through an obstacle that was drawn since the tracks were
        planned, or out of the field.
    """
    chosen = list(dict.fromkeys(format_named(name) for name in formats))
    given = dict(options or {})
    unknown = unknown_option(chosen, given)
    if unknown is not None:
        raise FormatError(f"No chosen format knows the option {unknown[0]!r}.", hint=unknown[1])
    _check_stem(stem)
    if len(datasets) > 1:
        datasets = distinct(datasets)
        field_ids(datasets)
    datasets = [made_whole(each) for each in datasets]
    tell_blocked(datasets, refuse=any(each.steers for each in chosen))
    target = Path(folder)
    written: list[Path] = []
    products = [each.places(target) for each in chosen]
    with staged_folder(target, overwrite=overwrite, inputs=inputs, products=products) as staging:
        for each in chosen:
            own = {key: value for key, value in given.items() if key in each.options}
            own |= given.get(each.name, {})
            own |= {key: _truth(key, own[key]) for key in _TRUTHS & own.keys()}
            if "picture" in each.options and not any(one.name == "scene" for one in chosen):
                own.setdefault("picture", all(one.picture_lies_in(target) for one in datasets))
            for path in _written(each, datasets, staging, stem, own):
                place = target / path.relative_to(staging)
                if place in written:
                    raise FormatError(
                        f"Two of the formats write {place.name}.",
                        hint="Write them into different folders, one after the other.",
                    )
                written.append(place)
        written = _replacing(written, target, staging)
    _tell_bare([one for one in datasets if any(each.pictured for each in chosen)])
    # Nobody takes the picture, map and report for a plan's whole content.
    for each in [each for each in chosen if tell_drops and not each.automatic]:
        told = (dropped(one, each, together=len(datasets) > 1) for one in datasets)
        words = list(dict.fromkeys(word for one in told for word in one))
        if words:
            warn(f"{each.title} cannot carry {_join(words)}.", FormatWarning)
        by_points = {"track_points", "tracks", "segments"} & set(each.layers) == {"track_points"}
        if by_points and any(one.has("tracks") and not one.has("track_points") for one in datasets):
            warn(
                f"{each.title} has nothing of the tracks: there are none of their points, which "
                "`geofield tracks` makes.",
                FormatWarning,
            )
    return written


def _truth(option: str, value: Any) -> Any:
    """A truth that was said as a text, as ``--option project=no`` does."""
    if not isinstance(value, str):
        return value
    for truth, texts in ((True, _YES), (False, _NO)):
        if value.strip().lower() in texts:
            return truth
    raise FormatError(f"{option} is {value!r}.", hint=f"Write {option}=yes or {option}=no.")


def _tell_bare(datasets: Sequence[Dataset]) -> None:
    """Warn of plans shown without the picture that they were made from: it is not at hand."""
    bare = [
        one.name
        for one in datasets
        if one.scene_path is None
        and one.table(schema.FIELD.name)["imagery"].fillna("").ne("").any()
    ]
    if bare:
        warn(
            f"Shown without the picture, which is not beside the plan: {', '.join(bare)}. "
            "`geofield export --picture` takes it from elsewhere.",
            FormatWarning,
        )


def _replacing(places: Sequence[Path], target: Path, staging: Path) -> list[Path]:
    """Keep what a person has in plans that are replaced; the places that still are written."""
    staged = {place: staging / place.relative_to(target) for place in places}
    for place, new in staged.items():
        if new.suffix == ".gpkg" and place.is_file():
            replace_plan(place, new)
    # A project that a person saved stays in its place.
    return [place for place, new in staged.items() if new.is_file()]


def _written(
    into: Format, datasets: Sequence[Dataset], folder: Path, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    write = into.load_writer()
    if into.fields == "many":
        return write(datasets, folder, stem=stem, options=options)
    if len(datasets) == 1:
        return write(datasets[0], folder, stem=stem, options=options)
    if into.fields == "joined":
        return write(joined(datasets), folder, stem=stem, options=options)
    written: list[Path] = []
    single = all("{stem}" in file for file in into.files)
    for each in datasets:
        name, place = safe_name(each.name), folder
        if into.fields == "one" and not single:
            place = folder / "fields" / name
            place.mkdir(parents=True, exist_ok=True)
        written += write(each, place, stem=name if single else stem, options=options)
    return written


def dropped(dataset: Dataset, into: Format, *, together: bool = False) -> list[str]:
    """What a format leaves out of a dataset, alone or together with others, in plain words."""
    layers = [
        each.title.lower()
        for each in dataset.layers()
        if each.name not in into.layers and dataset.has(each.name)
    ]
    # Segments are the tracks' pieces: a format with the one has the other's geometry.
    carried = set(into.layers)
    if "segments" in carried:
        layers = [title for title in layers if title != "tracks"]
    # And the tracks of a format with gaps are broken where they lie.
    if {"tracks", "gaps"} <= carried:
        layers = [title for title in layers if title != "segments"]
    if together and into.fields == "joined" and dataset.has(schema.TRACK_POINTS.name):
        layers.append(schema.TRACK_POINTS.title.lower())
    return layers + [drop.words for drop in into.drops if _present(dataset, drop.when, into)]


def _present(dataset: Dataset, when: str, into: Format) -> bool:
    if when == "provenance":
        return bool(dataset.provenance.settings or dataset.provenance.evidence)
    if when == "own":
        layers = (schema.FIELD, schema.OBSTACLES, schema.TRACKS, schema.SEGMENTS)
        own = {name for one in layers for name in schema.own_columns(one, dataset.table(one.name))}
        return not {str(name).lower() for name in own} <= {"customer", "farm"} & set(into.options)
    obstacles = dataset.table(schema.OBSTACLES.name)
    if when == "polygons":
        return bool(obstacles["radius_m"].isna().any())
    if when == "parts":
        return len(main_field(dataset, dataset.table(schema.FIELD.name).geometry.iloc[0])) > 1
    if when == "passed":
        return len(active(obstacles)) < len(obstacles)
    if when == "outside":
        outline = dataset.table(schema.FIELD.name).geometry.iloc[0]
        return not active(obstacles).intersects(outline).all()
    layer, _, column = when.partition(".")
    if column == "own":
        return _own_alone(dataset, layer)
    if not column:
        return dataset.has(layer)
    return bool(dataset.table(layer)[column].notna().any())


def _own_alone(dataset: Dataset, layer: str) -> bool:
    """Whether a layer of tracks has columns of a person's that the other does not tell as well."""
    here = dataset.table(layer)
    there = dataset.table("segments" if layer == "tracks" else "tracks")
    own = schema.own_columns(schema.layer(layer), here)
    if not set(own) <= set(there.columns):
        return True
    of_track = there.drop_duplicates("track_no").set_index("track_no")
    told = of_track[own].reindex(here["track_no"]).astype("string").fillna("").to_numpy()
    return bool((here[own].astype("string").fillna("").to_numpy() != told).any())


def unknown_option(chosen: Iterable[Format], given: Mapping[str, Any]) -> tuple[str, str] | None:
    """The first option that no chosen format knows, and what to tell of it; None without one.

    `given` has values by option, or by format mappings of them.
    """
    own = {each.name: each.options for each in chosen}
    known = {key for options in own.values() for key in options}
    asked = [(key, known) for key in given if key not in own]
    asked += [(key, set(options)) for name, options in own.items() for key in given.get(name, {})]
    for key, options in asked:
        if key not in options:
            others = [each.name for each in FORMATS.values() if key in each.options]
            if others:
                return key, f"It is an option of {_join(others)}."
            near = nearest(key, sorted(known)).strip()
            return key, near or f"Options: {', '.join(sorted(known)) or 'none'}."
    return None


def _check_stem(stem: str) -> None:
    if not stem or stem in (".", "..") or set(stem) & set('/\\:*?"<>|') or not stem.isprintable():
        raise FormatError(f"{stem!r} is not a file name.", hint="Use letters, digits, '-' and '_'.")


def _join(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
