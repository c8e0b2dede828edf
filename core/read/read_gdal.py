"""Read flat maps in the formats of other programs: shapefile, FlatGeobuf by GDAL (pyogrio),
GeoParquet by Arrow (pyarrow); both are installed with the extra `formats`.
"""

import importlib.util
import json
from pathlib import Path

from ..city.city import FileContent
from ..settings.errors import InputError
from ..settings.progress import silent
from .flat_map import choose_layer, map_of_wkb, name_of_definition
from .open_input import CUT, open_input
from .read_geojson import DEGREES


def need_package(path, name, what):
    """Refuse a file whose reader is not installed.

    Raises
    ------
    InputError
        Names the command that installs it.
    """
    if importlib.util.find_spec(name) is None:
        raise InputError(
            path,
            f"is {what}, whose reader is not installed",
            f"type: pip install {name} (in Blender: save it as GeoPackage or GeoJSON)",
        )


def read_vector(path, report_share=silent, *, choose=choose_layer):
    """Read the outlines of a shapefile or a FlatGeobuf, without compression.

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
        pyogrio is not installed, or the file has no outlines.
    """
    path, content = Path(path), FileContent(Path(path))
    need_package(path, "pyogrio", "a shapefile or a FlatGeobuf")
    open_input(path, report_share).close()
    import pyogrio

    with InputError.parsing(
        path, "cannot be read", f"{CUT}; a shapefile needs .shp, .shx, .dbf and .prj side by side"
    ):
        listed = pyogrio.list_layers(path)
        layers = {
            str(name): [str(field) for field in pyogrio.read_info(path, layer=name)["fields"]]
            for name, kind in listed.tolist()
            if kind is not None
        }
    name = choose(layers, content)
    with InputError.parsing(path, "cannot be read", CUT):
        meta, _, geometries, values = pyogrio.raw.read(path, layer=name, datetime_as_string=True)
    if meta["crs"] and (system := name_of_definition(meta["crs"])):
        content.srs_names[system] = 1
    columns = {str(field): own.tolist() for field, own in zip(meta["fields"], values, strict=True)}
    content.flat_map = map_of_wkb(geometries, [""] * len(geometries), columns, content)
    return content


def read_geoparquet(path, report_share=silent):
    """Read the outlines of a GeoParquet file.

    Parameters and errors as of `read_vector`, with pyarrow, and without layers.

    Returns
    -------
    FileContent
        With a FlatMap.
    """
    path, content = Path(path), FileContent(Path(path))
    need_package(path, "pyarrow", "GeoParquet")
    open_input(path, report_share).close()
    from pyarrow import parquet

    with InputError.parsing(path, "cannot be read as Parquet", CUT):
        file = parquet.ParquetFile(path)
        about = json.loads((file.schema_arrow.metadata or {}).get(b"geo", b"{}"))
    # GeoParquet names the column of geometries, their encoding and their system. A file without
    # that column, or with another encoding than WKB, is refused.
    name = about.get("primary_column", "geometry") if isinstance(about, dict) else "geometry"
    own = about.get("columns", {}).get(name, {}) if isinstance(about, dict) else {}
    if name not in file.schema_arrow.names:
        raise InputError(path, f"has no column {name!r}", "give GeoParquet")
    if own.get("encoding", "WKB") != "WKB":
        raise InputError(path, f"has geometries as {own['encoding']}", "write them as WKB")
    with InputError.parsing(path, "cannot be read as Parquet", CUT):
        # All columns but the boxes around the geometries.
        kept = [one for one in file.schema_arrow.names if one != "bbox"]
        table = file.read(columns=kept)
        columns = {one: table.column(one).to_pylist() for one in kept if one != name}
        geometries = table.column(name).to_pylist()
    # Without a word on the system it is degrees, as the format says; null means unknown.
    system = name_of_definition(json.dumps(own["crs"])) if own.get("crs") else DEGREES
    if own.get("crs", DEGREES) is not None and system:
        content.srs_names[system] = 1
    # Ids are texts of a column "id"; numbers do not count as ids here.
    ids = [
        str(one) if isinstance(one, str) else ""
        for one in columns.get("id", [None] * len(geometries))
    ]
    # Outlines with their ids and all columns as attributes.
    content.flat_map = map_of_wkb(geometries, ids, columns, content)
    return content
