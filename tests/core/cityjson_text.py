"""Small documents of CityJSON, put together from cubes."""

import json

from citypv.core.read.read_city import read_city

CUBE = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2]]
FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
SHELL = [[face] for face in FACES]


def solid(**more):
    return {"type": "Solid", "lod": "2", "boundaries": [SHELL], **more}


def house(*geometries, kind="Building", **more):
    return {"type": kind, "geometry": list(geometries), **more}


def model(objects, vertices=CUBE, **more):
    return {
        "type": "CityJSON",
        "version": "2.0",
        "CityObjects": objects,
        "vertices": vertices,
        **more,
    }


def read(tmp_path, document, **options):
    (tmp_path / "city.json").write_text(json.dumps(document), encoding="utf-8")
    return read_city(tmp_path / "city.json", **options)


def instance(number=0, corner=0, matrix=(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)):
    """A template set down at a vertex."""
    place = {"boundaries": [corner], "transformationMatrix": list(matrix)}
    return {"type": "GeometryInstance", "template": number, **place}


def at(number):
    """The cube whose corners follow those of so many others."""
    return {
        "type": "Solid",
        "lod": "2",
        "boundaries": [[[[k + 8 * number for k in ring]] for ring in FACES]],
    }


def row(count):
    """Corners of cubes that stand ten metres apart."""
    return [[x + 10 * k, y, z] for k in range(count) for x, y, z in CUBE]
