"""Which level of detail of each part of a building is taken: houses by hand, whose counts and areas
are known.
"""

import json

import numpy as np
import pytest
from citygml_text import building, members, model, polygon, solid, surface, wrap
from cityjson_text import model as json_model

from citypv.core.city.polygons import measure_polygons
from citypv.core.read.read_city import read_city


def box(*bounds):
    """Six faces of a box from its lowest and highest x, y, z: floor, top, south, east,
    north, west.
    """
    x0, y0, z0, x1, y1, z1 = bounds
    a, b, c, d = (x0, y0), (x1, y0), (x1, y1), (x0, y1)
    floor, top = (
        [(*corner, z0) for corner in (a, d, c, b)],
        [(*corner, z1) for corner in (a, b, c, d)],
    )
    sides = [
        [(*one, z0), (*two, z0), (*two, z1), (*one, z1)]
        for one, two in ((a, b), (b, c), (c, d), (d, a))
    ]
    return [floor, top, *sides]


HOUSE, ANTENNA = box(0, 0, 0, 10, 8, 8), box(4, 4, 8, 5, 5, 10)


def faces(*drawn):
    return members(*(polygon("", face) for face in drawn))


def part(*inside):
    return wrap("".join(inside), "bldg:consistsOfBuildingPart", "bldg:BuildingPart")


def installation(*inside):
    return wrap("".join(inside), "bldg:outerBuildingInstallation", "bldg:BuildingInstallation")


def body(drawn, lod):
    """Walls, roof and ground of one level, each with its class."""
    kinds = "GroundSurface", "RoofSurface", *["WallSurface"] * 4
    return "".join(
        surface(faces(face), kind, lod) for face, kind in zip(drawn, kinds, strict=False)
    )


def geometry(drawn, lod):
    return wrap(wrap(faces(*drawn), "gml:MultiSurface"), f"bldg:lod{lod}Geometry")


MIXES = {  # what a building holds, and the number of polygons and total area [m²] that are right
    "body in LoD1, antenna in LoD2": (
        (solid(faces(*HOUSE), 1), installation(geometry(ANTENNA, 2))),
        6,
        448,
    ),
    "body and antenna in LoD2": ((body(HOUSE, 2), installation(geometry(ANTENNA, 2))), 12, 458),
    "an antenna alone": ((installation(geometry(ANTENNA, 2)),), 6, 10),
    "LoD3, and one roof of LoD2": (
        (body(HOUSE, 3), surface(faces(box(0, 0, 0, 5, 8, 8)[1]), "RoofSurface")),
        6,
        448,
    ),
    "LoD1, and roofs of LoD2": (
        (solid(faces(*HOUSE), 1), surface(faces(HOUSE[1]), "RoofSurface")),
        6,
        448,
    ),
    "LoD1, and walls of LoD2": ((solid(faces(*HOUSE), 1), surface(faces(*HOUSE[2:]))), 6, 448),
    "LoD1, and a wall and a roof of LoD2": (
        (
            solid(faces(*HOUSE), 1),
            surface(faces(HOUSE[2])),
            surface(faces(box(0, 0, 0, 5, 8, 8)[1]), "RoofSurface"),
        ),
        *(6, 448),
    ),
    "LoD1, LoD2 without a floor": (
        (solid(faces(*HOUSE), 1), body(HOUSE, 2).split("</bldg:boundedBy>", 1)[1]),
        5,
        368,
    ),
    "LoD1, LoD2 half as high": ((solid(faces(*HOUSE), 1), body(box(0, 0, 0, 10, 8, 4), 2)), 6, 304),
    "a canopy without walls": (
        (surface(faces(HOUSE[1]), "RoofSurface", 2), surface(faces(HOUSE[1]), lod=1)),
        1,
        80,
    ),
    "part A in LoD2, B in LoD1": (
        (part(body(HOUSE, 2)), part(solid(faces(*box(10, 0, 0, 20, 8, 12)), 1))),
        *(12, 448 + 592),
    ),
    "the whole in LoD1, its parts in LoD2": (
        (
            solid(faces(*box(0, 0, 0, 20, 8, 8)), 1),
            part(body(HOUSE, 2)),
            part(body(box(10, 0, 0, 20, 8, 8), 2)),
        ),
        *(12, 2 * 448),
    ),
    "main house in LoD1, an annex in LoD2": (
        (solid(faces(*HOUSE), 1), part(body(box(10, 0, 0, 14, 8, 4), 2))),
        *(12, 448 + 160),
    ),
    "a tower in LoD1 on a podium in LoD2": (
        (part(body(HOUSE, 2)), part(solid(faces(*box(2, 2, 8, 6, 6, 40)), 1))),
        *(12, 448 + 544),
    ),
    "LoD1 and a footprint": (
        (
            wrap(wrap(faces(HOUSE[0]), "gml:MultiSurface"), "bldg:lod0FootPrint"),
            solid(faces(*HOUSE), 1),
        ),
        *(6, 448),
    ),
}


def read_mix(tmp_path, *inside, **options):
    (tmp_path / "mix.gml").write_text(model(building(*inside)), "utf-8")
    return read_city(tmp_path / "mix.gml", **options)


@pytest.mark.parametrize("name", MIXES)
def test_each_part_is_taken_whole_and_once(tmp_path, name):
    inside, count, area = MIXES[name]
    city = read_mix(tmp_path, *inside)
    assert len(city) == count
    assert measure_polygons(*city.shape)[0].sum() == pytest.approx(area, abs=1e-6)


def test_a_level_that_is_passed_over_is_said_and_can_be_asked_for(tmp_path):
    inside, _, _ = MIXES["LoD3, and one roof of LoD2"]
    city = read_mix(tmp_path, *inside)
    assert (
        city.report.lods_chosen == {"3": 6}
        and "LoD 2; LoD 3 was taken: house" in city.report.notes[-1]
    )
    city = read_mix(tmp_path, *inside, lod="2")
    assert city.report.lods_chosen == {"2": 1} and not city.report.notes


def test_an_installation_of_another_level_is_listed(tmp_path):
    city = read_mix(tmp_path, *MIXES["body in LoD1, antenna in LoD2"][0])
    assert city.report.skipped == {"installation without the LoD of its building": ["house"]}


@pytest.mark.parametrize("spelling", ["2", "2.2"])
def test_levels_of_cityjson_objects(tmp_path, spelling):
    """A body in two levels, of which one is a roof, and a balcony in the level that is taken."""
    drawn = [*HOUSE, *box(4, -1, 3, 6, 0, 3.2)]
    vertices = [list(corner) for face in drawn for corner in face]
    rings = [[list(range(4 * k, 4 * k + 4))] for k in range(len(drawn))]
    shape = {"type": "MultiSurface", "boundaries": rings[:6]}
    own = [
        {**shape, "lod": "3"},
        {**shape, "lod": "3.1", "boundaries": rings[1:2]},
        {**shape, "lod": spelling},
    ]
    own[2]["boundaries"] = rings[1:2]
    objects = {
        "house": {"type": "Building", "children": ["balcony"], "geometry": own},
        "balcony": {
            "type": "BuildingInstallation",
            "parents": ["house"],
            "geometry": [{**shape, "lod": "3.2"}],
        },
    }
    objects["balcony"]["geometry"][0]["boundaries"] = rings[6:]
    (tmp_path / "city.json").write_text(json.dumps(json_model(objects, vertices)), "utf-8")
    city = read_city(tmp_path / "city.json")
    assert city.report.lods_chosen == {"3": 6, "3.2": 6}
    area, _ = measure_polygons(*city.shape)
    balcony = np.array(city.thematic) == "BuildingInstallation"
    assert area[~balcony].sum() == pytest.approx(448) and area[balcony].sum() == pytest.approx(5.2)
