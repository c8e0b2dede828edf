"""The table of city formats: how each is told, who reads it, and what to do with one that is not
read.

A format that is read needs one row in READ and a reader of that name in `read_city`; errors,
folders, Blender's drop and its file browser follow from these rows.
"""

from typing import NamedTuple

from ..settings.errors import InputError
from .open_input import open_input, suffix_of


class Format(NamedTuple):
    """A format of files that hold a city, or something near it."""

    name: str
    suffixes: tuple  # in lower case, with dots
    reader: str = ""  # of `read_city.READERS`; "" if it is not read
    marks: tuple = ()  # bytes that files begin with, after white space
    words: tuple = ()  # one stands in the first 64 KB, where other formats begin alike
    cure: str = ""  # what to do with a file that is not read
    dropped: tuple = ()  # suffixes that Blender offers to us when a file is dropped


READ = (
    Format(
        "CityGML 1.0, 2.0, 3.0",
        (".gml", ".citygml", ".xml"),
        "citygml",
        (b"<",),
        dropped=(".gml", ".citygml", ".xml", ".gz"),
    ),
    Format(
        "CityJSON 1.0 to 2.0, CityJSONSeq",
        (".json", ".jsonl"),
        "cityjson",
        (b"{",),
        (b'"CityJSON', b'"CityObjects"'),
        dropped=(".json", ".jsonl"),
    ),
    Format("OBJ", (".obj",), "obj", dropped=(".obj",)),
    Format(
        "GeoJSON, GeoJSONSeq",
        (".geojson", ".geojsonl", ".geojsons", ".ndjson"),
        "geojson",
        (b"{", b"\x1e"),
        (b'"FeatureCollection"', b'"Feature"'),
        dropped=(".geojson", ".geojsonl", ".geojsons", ".ndjson"),
    ),
    Format("GeoPackage", (".gpkg",), "geopackage", (b"SQLite format 3\0",), dropped=(".gpkg",)),
    Format(
        "OpenStreetMap XML, Overpass JSON, PBF",
        (".osm", ".pbf"),
        "osm",
        (b"<", b"{"),
        (b"<osm", b'"elements"'),
        dropped=(".osm", ".pbf"),
    ),
    Format(
        "Shapefile, FlatGeobuf",
        (".shp", ".fgb"),
        "vector",
        (b"fgb\x03", b"\0\0\x27\x0a"),
        dropped=(".shp", ".fgb"),
    ),
    Format(
        "GeoParquet",
        (".parquet", ".geoparquet"),
        "geoparquet",
        (b"PAR1",),
        dropped=(".parquet", ".geoparquet"),
    ),
)
_MESH = "import it into Blender and take its meshes as a city, or export it from there as OBJ"
NOT_READ = (
    Format(
        "part of a shapefile",
        (".shx", ".dbf", ".prj", ".cpg"),
        cure="give the file that ends in .shp, with the others beside it",
    ),
    Format(
        "KML, a map", (".kml", ".kmz"), cure="save it as GeoPackage or GeoJSON, for example in QGIS"
    ),
    Format(
        "IFC, the model of one building with its inside",
        (".ifc",),
        marks=(b"ISO-10303-21",),
        cure=(
            "export the outer surfaces as OBJ, for example with IfcConvert, or take them as meshes "
            "in Blender"
        ),
    ),
    Format("a glTF mesh", (".glb", ".gltf", ".b3dm"), marks=(b"glTF", b"b3dm"), cure=_MESH),
    Format(
        "a Blender file",
        (".blend",),
        marks=(b"BLENDER",),
        cure="open it in Blender and take its meshes as a city",
    ),
    Format("a mesh", (".fbx", ".dae", ".stl", ".ply", ".3ds", ".usd", ".usdz"), cure=_MESH),
    Format("a drawing", (".dxf", ".dwg"), cure="export its faces as OBJ"),
    Format(
        "a SketchUp model",
        (".skp",),
        marks=(b"\xff\xfe\xff\x0eS\0k\0e\0t\0c\0h\0",),
        cure="export it from SketchUp as OBJ, in metres",
    ),
    Format(
        "a raster of heights or an image",
        (".tif", ".tiff", ".asc", ".agr", ".grd", ".vrt"),
        marks=(b"II*\0", b"MM\0*", b"II+\0", b"ncols"),
        cure=(
            "give terrain with --terrain, distant hills with --horizon, and buildings in a file of "
            "their own"
        ),
    ),
    Format(
        "a cloud of points",
        (".las", ".laz", ".e57"),
        marks=(b"LASF",),
        cure="reconstruct buildings first, or make a raster of its ground for --terrain",
    ),
    Format(
        "an archive", (".zip", ".7z", ".tar", ".rar"), cure="unpack it and give the files inside"
    ),
    Format(
        "weather, not a city",
        (".epw", ".nc", ".tm2", ".tm3"),
        cure="give it with --weather, after the city",
    ),
)
SUFFIXES = tuple(suffix for row in READ for suffix in row.suffixes)
DROPPED = tuple(suffix for row in READ for suffix in row.dropped)


def format_of(path):
    """The row of the table that a file belongs to: by its first bytes, else by its name; CityGML
    for any other.

    Raises
    ------
    InputError
        The file cannot be opened, or is of a format that is not read.
    """
    with open_input(path) as stream:
        # How a file begins tells what it is.
        head = stream.read(2**16).removeprefix(b"\xef\xbb\xbf").lstrip()
    suffix = suffix_of(path)
    marked = [row for row in (*READ, *NOT_READ) if head.startswith(row.marks)] if head else []
    # Of formats that begin alike, the one whose words stand there.
    worded = [row for row in marked if any(word in head for word in row.words)]
    marked = worded or [row for row in marked if suffix in row.suffixes] or marked
    named = [row for row in (*READ, *NOT_READ) if suffix in row.suffixes]
    # A name of a format that is not read says more than a first sign that many formats have.
    row = next((row for row in named if not row.reader), None) or next(
        iter([*marked, *named]), READ[0]
    )
    if not row.reader:
        raise InputError(path, f"is {row.name}", row.cure)
    return row
