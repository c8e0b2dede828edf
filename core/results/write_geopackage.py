"""Write city.gpkg: surfaces and buildings with their results, for geographic information systems.

GeoPackage 1.3 (OGC 12-128r17) is an SQLite file with some tables of its own; geometries are a
header and ISO WKB.
"""

import sqlite3
import struct
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj
import shapely

from ..city.building_facts import FACTS
from ..settings.progress import silent
from .columns import TABLED
from .write_buildings import sum_buildings

TABLES = """
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY, organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE,
  description TEXT DEFAULT '', last_change DATETIME NOT NULL, min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE,
  srs_id INTEGER REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL,
  PRIMARY KEY (table_name, column_name), UNIQUE (table_name),
  FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
"""


def write_geopackage(path, run, progress=silent):
    """Write a city with its results as a GeoPackage with two layers.

    `surfaces` has a 3D polygon for each surface with the columns of faces.csv; `buildings` has the
    footprints, the union of what is not vertical seen from above, with the columns of
    buildings.csv.

    Parameters
    ----------
    path : path-like
    run : RunResults
    progress : callable, optional
        See `core.settings.progress`.
    """
    stage = "writing city.gpkg"
    city, _, transfer, energy, weather = run
    # A file that is there already is replaced.
    Path(path).unlink(missing_ok=True)
    # Coordinates stay in the files' system, easting or longitude first as the format wants.
    city = replace(city, points=city.grid.to_files(city.points, "xy"))
    # Polygons of the surfaces; tables of surfaces and buildings, with the SQL type of each column.
    shapes = np.array(
        [shapely.Polygon(rings[0], rings[1:]) for rings in map(city.rings, range(len(city)))],
        object,
    )
    columns, rows = TABLED, sum_buildings(transfer, energy, weather)
    types = dict.fromkeys(rows, "DOUBLE") | {
        **dict.fromkeys(("building_id", *FACTS), "TEXT"),
        "year": "INTEGER",
        **({"height_source": "TEXT"} if "height_source" in rows else {}),
        "surfaces": "INTEGER",
        "eligible": "INTEGER",
    }
    # NULL where nothing is told.
    rows[[*FACTS]] = rows[[*FACTS]].replace("", None)
    surfaces = pd.DataFrame({column.name: column.values_of(transfer, energy) for column in columns})
    layers = {  # name -> columns, their SQL types, geometries
        "surfaces": (
            surfaces,
            {
                column.name: {"text": "TEXT", "flag": "BOOLEAN", "number": "DOUBLE"}[column.kind]
                for column in columns
            },
            shapes,
        ),
        "buildings": (rows, types, _draw_footprints(city, shapes, rows["building_id"])),
    }
    # A GeoPackage is an SQLite file with a number that says so ("GPKG", version 1.3.0; requirement
    # 2), and tables on its layers.
    with closing(sqlite3.connect(path)) as file, file:
        file.execute(f"PRAGMA application_id = {0x47504B47}")
        file.execute("PRAGMA user_version = 10300")
        file.executescript(TABLES)
        number = write_system(file, city.crs)
        for done, (name, layer) in enumerate(layers.items()):
            progress(stage, done, len(layers), "layers")
            _write_layer(file, (name, number, f"weather: {weather.label}"), *layer)
        progress(stage, len(layers), len(layers), "layers")


def _draw_footprints(city, shapes, names):
    """Footprints of buildings: (b,) array of shapely geometries.

    Parameters
    ----------
    city : City
    shapes : (n,) array of shapely.Polygon
    names : sequence of str
        Of the buildings.
    """
    flat = shapely.make_valid(shapely.force_2d(shapes))
    # polygons; walls become lines
    wide = np.isin(shapely.get_type_id(flat), (3, 6)) & (shapely.area(flat) > 0)
    members = {}
    for row in np.flatnonzero(wide).tolist():
        members.setdefault(city.building_id[row], []).append(row)
    unions = [shapely.union_all(flat[members.get(name, [])]) for name in names]
    return np.array(
        [
            shapely.MultiPolygon([p for p in shapely.get_parts(union) if p.area > 0])
            for union in unions
        ],
        object,
    )


def write_system(file, crs):
    """Write the reference systems that every GeoPackage has, and the city's; return its srs_id."""
    rows = [
        ("Undefined Cartesian", -1, "NONE", -1, "undefined", None),
        ("Undefined geographic", 0, "NONE", 0, "undefined", None),
        ("WGS 84", 4326, "EPSG", 4326, pyproj.CRS(4326).to_wkt("WKT1_GDAL"), None),
    ]
    # -1: Cartesian, without a reference.
    number = -1
    if crs:
        system = pyproj.CRS.from_user_input(crs)
        system = system.sub_crs_list[0] if system.is_compound else system
        code = system.to_epsg(100)
        # A system without an EPSG code has a number of its own.
        number, organization = (100000, "NONE") if code is None else (code, "EPSG")
        if number != 4326:
            rows.append(
                (system.name, number, organization, number, system.to_wkt("WKT1_GDAL"), None)
            )
    file.executemany("INSERT INTO gpkg_spatial_ref_sys VALUES (?, ?, ?, ?, ?, ?)", rows)
    return number


def _write_layer(file, layer, table, types, shapes):
    """Write a layer and its entries in the tables of contents.

    Parameters
    ----------
    file : sqlite3.Connection
    layer : tuple
        Name, srs_id and description.
    table : pandas.DataFrame
        Columns, with their SQL types in `types`.
    types : dict
    shapes : (n,) array of shapely geometries
    """
    name, number, description = layer
    box = shapely.total_bounds(shapes).tolist()
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S.000Z")
    spatial = bool(shapely.has_z(shapes).any())
    kind = "POLYGON" if spatial else "MULTIPOLYGON"
    file.execute(
        "INSERT INTO gpkg_contents VALUES (?, 'features', ?, ?, ?, ?, ?, ?, ?, ?)",
        (name, name, description, now, *box, number),
    )
    file.execute(
        "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, ?, 0)",
        (name, kind, number, int(spatial)),
    )
    # Flags of a geometry: little-endian, whether it is empty; its envelope is left out.
    heads = (
        struct.pack("<2sBBi", b"GP", 0, 0b1 | 0b10000 * shape.is_empty, number) for shape in shapes
    )
    packed = map(
        bytes.__add__, heads, shapely.to_wkb(shapes, output_dimension=3, byte_order=1, flavor="iso")
    )
    table = table.assign(fid=np.arange(1, len(table) + 1), geom=list(packed))
    types = {"fid": "INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL", "geom": kind, **types}
    table[list(types)].to_sql(name, file, index=False, dtype=types)  # NaN becomes NULL
