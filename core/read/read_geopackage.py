"""Read GeoPackage (OGC 12-128r17): an SQLite file whose geometries are a header and well-known
binary.
"""

import sqlite3
from contextlib import closing
from pathlib import Path

from ..city.city import FileContent
from ..settings.errors import InputError
from ..settings.progress import silent
from .flat_map import choose_layer, map_of_wkb, name_of_definition
from .open_input import CUT, Budget, open_input

ENVELOPES = (0, 32, 48, 48, 64)  # bytes of the envelope in a header, by its kind


def read_geopackage(path, report_share=silent, *, choose=choose_layer):
    """Read the outlines of the layer of a GeoPackage that has buildings, or of another one.

    Parameters
    ----------
    path : path-like
    report_share : callable, optional
        As in `open_input`.
    choose : callable, optional
        Name of the layer, as `choose_layer`.

    Returns
    -------
    FileContent
        With a FlatMap.

    Raises
    ------
    InputError
        Not a GeoPackage, or without outlines.
    """
    path = Path(path)
    content = FileContent(path)
    with closing(_open_database(path)) as file:
        with InputError.parsing(path, "cannot be read as a GeoPackage", CUT):
            layers = {
                name: (column, number)
                for name, column, number in _ask(
                    file, "SELECT table_name, column_name, srs_id FROM gpkg_geometry_columns"
                )
            }
            columns = {name: _list_columns(file, name, layers[name][0]) for name in layers}
        name = choose(columns, content)
        with InputError.parsing(path, "cannot be read as a GeoPackage", CUT):
            _note_system(file, layers[name][1], content)
            geometries, attributes = _read_layer(file, (name, layers[name][0]), columns[name], path)
    report_share(0.5)
    content.flat_map = map_of_wkb(geometries, [""] * len(geometries), attributes, content)
    report_share(0.9)
    return content


def _open_database(path):
    """An SQLite file, opened to be read; a compressed one is unpacked in memory."""
    with open_input(path) as stream:
        head = stream.read(16)
        if not head.startswith(b"SQLite format 3\0"):
            raise InputError(path, "is not a GeoPackage", CUT)
        file = None
        with path.open("rb") as plain:
            if plain.read(16) != head:
                file = sqlite3.connect(":memory:")
                file.deserialize(head + stream.read())
    if file is None:
        file = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
    # Views and triggers of the file may call nothing.
    file.execute("PRAGMA trusted_schema = OFF")
    file.text_factory = lambda text: text.decode("utf-8", errors="replace")
    return file


def _ask(file, question, *values):
    try:
        return file.execute(question, values).fetchall()
    except sqlite3.Error as error:
        raise ValueError(str(error)) from error


def _quote(name):
    return '"' + name.replace('"', '""') + '"'


def _list_columns(file, table, geometry):
    """Attributes of a layer: list of str."""
    rows = _ask(file, f"SELECT name FROM pragma_table_info({_quote(table)})")
    return [name for (name,) in rows if name != geometry]


def _note_system(file, number, content):
    """Name of the reference system with a number."""
    rows = _ask(
        file,
        "SELECT organization, organization_coordsys_id, definition FROM gpkg_spatial_ref_sys "
        "WHERE srs_id = ?",
        number,
    )
    for organization, code, definition in rows if number not in (0, -1) else ():
        known = str(organization).upper() == "EPSG"
        name = f"EPSG:{code}" if known else name_of_definition(definition)
        if name:
            content.srs_names[name] = 1


def _read_layer(file, layer, columns, path):
    """Geometries of a layer as well-known binary, and its attributes: list, dict of lists.

    Parameters
    ----------
    file : sqlite3.Connection
    layer : tuple of str
        Its table, and the column of geometries.
    columns : list of str
    path : path-like
    """
    chosen = ", ".join(map(_quote, (layer[1], *columns)))
    budget = Budget(path, "holds a layer", "split it into tiles")
    geometries, rows = [], []
    try:
        for geometry, *values in file.execute(f"SELECT {chosen} FROM {_quote(layer[0])}"):
            budget.spend(len(geometry or b"") + 64 * len(values) + 100)
            geometries.append(_strip_header(geometry))
            rows.append(values)
    except sqlite3.Error as error:
        raise ValueError(str(error)) from error
    return geometries, {name: [row[k] for row in rows] for k, name in enumerate(columns)}


def _strip_header(data):
    """Well-known binary behind the header of a geometry; None where there is none."""
    if not isinstance(data, bytes) or len(data) < 8 or data[:2] != b"GP":
        return None
    envelope, empty = data[3] >> 1 & 7, data[3] & 16
    return None if empty or envelope >= len(ENVELOPES) else data[8 + ENVELOPES[envelope] :]
