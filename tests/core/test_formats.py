"""Formats of cities, and units and the upward axis where files state none."""

import re
from pathlib import Path

import numpy as np
import pytest
from sheds import CLOSED, check_shed, stand, write_shed

from citypv.core.read.formats import READ
from citypv.core.run.study import read_buildings
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

pytestmark = pytest.mark.every_python

HOUSES = [(0, 0, 0), (20, 0, 5), (40, 0, 10)]
GABLE = [
    (0, 0, 0),
    (0, 8, 0),
    (10, 8, 0),
    (10, 0, 0),
    (0, 0, 6),
    (10, 0, 6),
    (10, 4, 10),
    (0, 4, 10),
    (10, 8, 6),
]
GABLE += [(0, 8, 6)]
FACES = [
    (1, 2, 3, 4),
    (5, 6, 7, 8),
    (9, 10, 8, 7),
    (1, 4, 6, 5),
    (3, 2, 10, 9),
    (4, 3, 9, 7, 6),
    (2, 1, 5, 8, 10),
]


def write_houses(path, turn):
    """Three houses as an OBJ whose coordinates a function of (n, 3) points changes: path."""
    lines = []
    for number, place in enumerate(HOUSES):
        points = turn(np.array(GABLE, float) + place)
        lines += [f"o b{number}", *(f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in points)]
        lines += [
            "f " + " ".join(str(corner + number * len(GABLE)) for corner in face) for face in FACES
        ]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("name", "turn", "option"),
    [
        ("metres", lambda points: points, None),
        ("millimetres", lambda points: 1000 * points, "--unit m "),
        ("y up", lambda points: points[:, [0, 2, 1]] * [1, 1, -1], "--up z "),
    ],
)
def test_sizes_that_leave_no_doubt(tmp_path, name, turn, option):
    """Three houses of 248 m² of facades and 113.1 m² of roofs, as they are, and said where
    something was chosen.
    """
    city, scene = stand(write_houses(tmp_path / "houses.obj", turn))
    areas = {
        kind: scene.surfaces.area[scene.surfaces.kind == kind].sum() for kind in ("facade", "roof")
    }
    assert areas == pytest.approx({"facade": 744.0, "roof": 3 * 2 * 10 * 32**0.5})
    assert [
        note for note in city.report.notes if "--" in note and not (option and option in note)
    ] == []
    assert option is None or any(option in note for note in city.report.notes)


@pytest.mark.parametrize(
    ("name", "turn", "words"),
    [
        ("centimetres", lambda points: 100 * points, "--unit in or --unit cm"),
        ("level", lambda points: points, None),
    ],
)
def test_sizes_in_doubt_are_only_said(tmp_path, name, turn, words):
    city, _ = stand(write_houses(tmp_path / "houses.obj", turn))
    assert np.ptp(city.points[:, 0]) == pytest.approx(50 * (100 if words else 1))
    assert any(words in note for note in city.report.notes) if words else not city.report.notes
    given = stand(tmp_path / "houses.obj", unit="cm")[0]
    assert np.ptp(given.points[:, 0]) == pytest.approx(0.5 * (100 if words else 1))
    assert not any("--unit" in note for note in given.report.notes)


@pytest.mark.parametrize(
    ("name", "head", "words"),
    [
        ("map.geojson", b'{"type": "FeatureCollection"}', "features is not a list"),
        (
            "map.json",
            b'{"type": "FeatureCollection", "features": []}',
            "contains no outlines; give a file with polygons",
        ),
        ("map.gpkg", b"SQLite format 3\0", "cannot be read as a GeoPackage"),
        ("map.data", b"SQLite format 3\0", "cannot be read as a GeoPackage"),
        ("map.dbf", b"\3\0\0\0", "is part of a shapefile; give the file that ends in .shp"),
        ("house.ifc", b"ISO-10303-21;", "is IFC"),
        ("mesh.glb", b"glTF\2\0\0\0", "is a glTF mesh"),
        ("dem.tif", b"II*\0", "give terrain with --terrain"),
        ("cloud.las", b"LASF", "is a cloud of points"),
        ("hut.skp", b"\xff\xfe\xff\x0eS\0k\0e\0t\0c\0h\0U\0p\0", "export it from SketchUp as OBJ"),
        ("berlin.epw", b"LOCATION,Berlin", "give it with --weather"),
    ],
)
def test_files_of_other_formats_are_told_what_they_are(tmp_path, name, head, words):
    (tmp_path / name).write_bytes(head)
    with pytest.raises(InputError, match=re.escape(words)):
        read_buildings([tmp_path / name], Request())


def test_the_first_bytes_tell_the_format(tmp_path):
    path = write_shed(tmp_path / "shed.gml", "EPSG:25832", 51.4, 9.0, envelope=CLOSED)
    check_shed(stand(path.rename(tmp_path / "shed.json"))[1], 51.4, 9.0, 2e-3)


def test_the_guide_lists_the_formats_that_are_read():
    guide = (Path(__file__).parents[2] / "docs" / "guide" / "your_city.md").read_text("utf-8")
    for row in READ:
        suffixes = ", ".join(f"`{suffix}`" for suffix in row.suffixes)
        assert f"| {row.name} | {suffixes}" in guide
