"""Trees of CityGML and CityJSON: shapes, implicit geometry, and trees of which only numbers are
given.
"""

import gzip
from pathlib import Path

import numpy as np
import pytest
from citygml_text import members, polygon, wrap
from cityjson_text import CUBE, house, instance, model, read, solid
from small_city import write_gml
from thorough import mark_cases

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.crowns import cylinder, unit_sphere
from citypv.core.commands.command_line import main
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python

DATA = Path(__file__).parents[1] / "data"
HEAD = (
    '<CityModel xmlns="http://www.opengis.net/citygml/2.0" xmlns:gml="http://www.opengis.net/gml" '
    'xmlns:bldg="http://www.opengis.net/citygml/building/2.0" '
    'xmlns:gen="http://www.opengis.net/citygml/generics/2.0" '
    'xmlns:veg="http://www.opengis.net/citygml/vegetation/2.0" xmlns:xlink="http://www.w3.org/1999/xlink">'
    '<gml:boundedBy><gml:Envelope srsName="EPSG:25833"/></gml:boundedBy>'
)


def surfaces(*faces):
    return wrap(members(*(polygon("", face) for face in faces)), "gml:MultiSurface")


ROOF = [(390000, 5810000, 3), (390010, 5810000, 3), (390010, 5810010, 3), (390000, 5810010, 3)]
HOUSE = (
    "<bldg:Building "
    f'gml:id="house"><bldg:lod2MultiSurface>{surfaces(ROOF)}</bldg:lod2MultiSurface></bldg:Building>'
)
DENSITY = (
    '<gen:doubleAttribute name="leafAreaDensity"><gen:value>{}</gen:value></gen:doubleAttribute>'
)
POINT = "<gml:Point><gml:pos>390020 5810000 2</gml:pos></gml:Point>"


def read_gml(tmp_path, *plants):
    objects = (f"<cityObjectMember>{text}</cityObjectMember>" for text in (HOUSE, *plants))
    return build_scene(read_city(write_gml(tmp_path / "trees.gml", *objects, head=HEAD))).trees


def tree(inside, kind="SolitaryVegetationObject"):
    return f'<veg:{kind} gml:id="oak">{inside}</veg:{kind}>'


@pytest.mark.slow
def test_trees_of_berlin_stand_where_their_attributes_say(tmp_path):
    """Places and heights of the file's own attributes, which reading ignores (X, Y, Z) or replaces
    by the shape.
    """
    path = DATA / "citygml" / "berlin_trees.gml.gz"
    text = gzip.decompress(path.read_bytes()).decode()
    own = write_gml(
        tmp_path / "house.gml", f"<cityObjectMember>{HOUSE}</cityObjectMember>", head=HEAD
    )
    city = read_city([own, path])
    scene = build_scene(city)
    crowns = scene.trees
    heights = [float(part.partition("<")[0]) for part in text.split('<veg:height uom="m">')[1:]]
    assert len(crowns) == len(heights) == 12
    assert crowns.height == pytest.approx(
        np.array(heights), rel=0.01
    )  # prototypes are 1.000 to 1.004 high
    told = [
        [
            part.partition("<gen:value>")[2].partition("<")[0]
            for part in text.split(f'name="{k}"')[1:]
        ]
        for k in "XYZ"
    ]
    places = scene.site.from_files(np.array(told, float).T)
    for number, place in enumerate(places):
        own = crowns.vertices[crowns.triangles[crowns.tree == number]].reshape(-1, 3)
        assert np.linalg.norm((own.min(axis=0) + own.max(axis=0))[:2] / 2 - place[:2]) < 0.2
        assert own[:, 2].min() == pytest.approx(place[2], abs=0.1)
    assert (crowns.volume > 0).all() and crowns.trunk.any()


def test_a_tree_of_which_only_numbers_are_given(tmp_path):
    numbers = (
        "<veg:class>1060</veg:class><veg:height "
        "uom='m'>12</veg:height><veg:trunkDiameter>0.4</veg:trunkDiameter>"
    )
    numbers += f"{DENSITY.format(0.7)}<veg:crownDiameter>6</veg:crownDiameter>{POINT}"
    crowns = read_gml(tmp_path, tree(numbers))
    assert crowns.volume == pytest.approx(np.pi / 6 * 6**2 * 12 * (1 - 0.25))
    assert crowns.height == 12 and crowns.trunk.sum() == 16 and crowns.evergreen.all()
    assert crowns.area_density == pytest.approx(0.7)


@pytest.mark.slow
def test_a_closed_shape_is_a_crown_and_crossed_pictures_are_in_a_hull(tmp_path):
    x, y = 390020, 5810000
    low = [(x, y, 2), (x + 2, y, 2), (x + 2, y + 2, 2), (x, y + 2, 2)]
    high = [(a, b, 7) for a, b, _ in low]
    walls = [(low[k], low[(k + 1) % 4], high[(k + 1) % 4], high[k]) for k in range(4)]
    for faces in ([low[::-1], high, *walls], [low, high[::-1], *(wall[::-1] for wall in walls)]):
        crowns = read_gml(
            tmp_path, tree(f"<veg:lod2Geometry>{surfaces(*faces)}</veg:lod2Geometry>")
        )
        assert crowns.volume == pytest.approx(20, rel=1e-4) and not crowns.trunk.any()
    crossed = [(low[0], low[2], high[2], high[0]), (low[1], low[3], high[3], high[1])]
    crowns = read_gml(tmp_path, tree(f"<veg:lod2Geometry>{surfaces(*crossed)}</veg:lod2Geometry>"))
    assert crowns.volume == pytest.approx(20, rel=1e-4)


@pytest.mark.slow
def test_the_lowest_faces_of_a_round_crown_are_no_trunk(tmp_path):
    """All of a ball of leaves lets light through; a stem below it does not."""
    sphere, triangles = unit_sphere()
    vertices = np.array([390020, 5810000, 14]) + 10 * sphere
    faces = [[tuple(point) for point in vertices[triangle]] for triangle in triangles]
    crowns = read_gml(tmp_path, tree(f"<veg:lod3Geometry>{surfaces(*faces)}</veg:lod3Geometry>"))
    assert crowns.volume == pytest.approx(4 / 3 * np.pi * 1000, rel=1e-3) and not crowns.trunk.any()
    stem = cylinder(np.array([390020, 5810000, 1.0]), 0.3, 5)
    faces += [[tuple(point) for point in stem[0][triangle]] for triangle in stem[1]]
    crowns = read_gml(tmp_path, tree(f"<veg:lod3Geometry>{surfaces(*faces)}</veg:lod3Geometry>"))
    assert crowns.trunk.sum() == len(stem[1])


def test_an_area_of_plants_is_raised_by_its_height(tmp_path):
    area = [(390020, 5810000, 2), (390030, 5810000, 2), (390030, 5810004, 2), (390020, 5810004, 2)]
    shape = f"<veg:lod1MultiSurface>{surfaces(area)}</veg:lod1MultiSurface>"
    crowns = read_gml(
        tmp_path, tree(f"<veg:averageHeight uom='m'>3</veg:averageHeight>{shape}", "PlantCover")
    )
    assert crowns.volume == pytest.approx(120, rel=1e-4)


def terraces(step, wall):
    """Two squares of 10 m on a slope, the second one higher by a step, with or without walls around
    each.
    """
    faces, y = [], 5810000
    for x, z in ((390020, 2), (390030, 5 + step)):
        square = [(x, y, z), (x + 10, y, z + 3), (x + 10, y + 10, z + 3), (x, y + 10, z)]
        faces.append(square)
        for a, b in zip(square, [*square[1:], square[0]], strict=True) if wall else ():
            faces.append([(*a[:2], a[2] - wall), (*b[:2], b[2] - wall), b, a])
    if step:
        faces.append(
            [(390030, y, 5), (390030, y + 10, 5), (390030, y + 10, 5 + step), (390030, y, 5 + step)]
        )
    return faces


@pytest.mark.parametrize("step", mark_cases([0, 0.4], kept=1))
def test_lawns_on_a_hillside_are_no_crowns(tmp_path, step):
    """3dfier draws them so. Their convex hull would be a hedge as high as the hill, which hides the
    ground floor.
    """
    plants = tree(
        f"<veg:lod1MultiSurface>{surfaces(*terraces(step, 0))}</veg:lod1MultiSurface>", "PlantCover"
    )
    assert read_gml(tmp_path, plants) is None
    scene = build_scene(read_city(tmp_path / "trees.gml"))
    assert scene.report.skipped[
        "vegetation drawn as an area without a height: it casts no shadow"
    ] == ["oak"]


def test_plants_with_walls_around_them_are_a_body(tmp_path):
    """A wood of 4 m without a bottom: 20 m by 10 m."""
    plants = tree(
        f"<veg:lod1MultiSurface>{surfaces(*terraces(0, 4))}</veg:lod1MultiSurface>", "PlantCover"
    )
    assert read_gml(tmp_path, plants).volume == pytest.approx(800, rel=1e-4)


SIZE = "<veg:height uom='{}'>{}</veg:height>"
CROWN = "<veg:crownDiameter>{}</veg:crownDiameter>"
FEET = "urn:ogc:def:uom:UCUM::[ft_i]"


@pytest.mark.parametrize(
    ("inside", "reason"),
    [
        ("", "vegetation without a shape that has a volume, and without a height"),
        (POINT, "vegetation without a shape that has a volume, and without a height"),
        (
            "<veg:height>12</veg:height>",
            "vegetation without a shape that has a volume, and without a place",
        ),
        (f"{SIZE.format('m', -2)}{POINT}", "tree: height is no number above 0"),
        (f"{SIZE.format('m', 0)}{POINT}", "tree: height is no number above 0"),
        (f"{SIZE.format('m', 'high')}{POINT}", "tree: height is no number above 0"),
        (SIZE.format("m", 9) + CROWN.format(0) + POINT, "tree: crownDiameter is no number above 0"),
        (
            f"{SIZE.format('yard', 9)}{POINT}",
            "tree: height in a unit that is not known: give metres",
        ),
        (
            f"{SIZE.format('m', 1200)}{POINT}",
            "tree: height of more than 130 m is not believed: check its unit",
        ),
    ],
)
def test_a_tree_that_cannot_be_used_is_left_out_and_listed(tmp_path, capsys, inside, reason):
    """The house and the good tree beside it stay."""
    bad = tree(inside, "SolitaryVegetationObject" if inside else "PlantCover")
    good = tree(f"{SIZE.format('m', 9)}{POINT}").replace("oak", "elm")
    crowns = read_gml(tmp_path, bad, good)
    assert crowns.names == ["elm"]
    assert build_scene(read_city(tmp_path / "trees.gml")).report.skipped == {reason: ["oak"]}
    assert main(["inspect", str(tmp_path / "trees.gml")]) == 0
    assert f"skipped 1: {reason} (oak)" in capsys.readouterr().out


@pytest.mark.parametrize(("unit", "height"), [("cm", 914.4), ("ft", 30), (FEET, 30), ("m", 9.144)])
def test_sizes_of_trees_in_other_units(tmp_path, unit, height):
    crowns = read_gml(tmp_path, tree(f"{SIZE.format(unit, height)}{POINT}"))
    assert crowns.height == pytest.approx(9.144)


@pytest.mark.parametrize(
    "given", ["<veg:trunkDiameter>0</veg:trunkDiameter>", DENSITY.format(-0.1)]
)
def test_a_trunk_or_density_that_is_none_is_taken_as_not_given(tmp_path, given):
    crowns = read_gml(tmp_path, tree(f"{given}{SIZE.format('m', 9)}{POINT}"))
    assert not crowns.trunk.any() and np.isnan(crowns.area_density).all()


def test_trees_of_cityjson_by_template_by_solid_and_by_numbers(tmp_path):
    templates = {"templates": [solid()], "vertices-templates": CUBE}
    plant, numbers = (
        {"type": "SolitaryVegetationObject"},
        {"height": {"value": 8, "uom": "m"}, "crownDiameter": "4"},
    )
    objects = {
        "house": house(solid()),
        "lime": plant
        | {
            "geometry": [
                instance(corner=6, matrix=(3, 0, 0, 0, 0, 2, 0, 0, 0, 0, 4, 0, 0, 0, 0, 1))
            ]
        },
        "yew": plant
        | {"geometry": [solid()], "attributes": {"class": "coniferous", "leafAreaDensity": 2}},
        "ash": plant
        | {
            "geometry": [{"type": "MultiPoint", "lod": "0", "boundaries": [6]}],
            "attributes": numbers,
        },
        "hedge": {"type": "PlantCover", "geometry": [solid()]},
    }
    city = read(tmp_path, model(objects, **{"geometry-templates": templates}))
    crowns = build_scene(city, latitude=50, longitude=8).trees
    expected = {"lime": 8 * 24, "yew": 8, "ash": np.pi / 6 * 16 * 6, "hedge": 8}
    assert dict(zip(crowns.names, crowns.volume, strict=True)) == pytest.approx(expected, rel=1e-4)
    assert crowns.evergreen.tolist() == [False, True, False, False] and crowns.area_density[1] == 2
    assert city.report.building_count == 1 and len(city) == 6


@pytest.mark.parametrize("height", [[12], True, {"value": "tall"}])
def test_a_height_of_cityjson_that_is_no_number(tmp_path, height):
    yew = {
        "type": "SolitaryVegetationObject",
        "geometry": [solid()],
        "attributes": {"height": height},
    }
    objects = {"house": house(solid()), "yew": yew}
    city = read(tmp_path, model(objects))
    assert city.report.skipped == {
        "size of a tree that has a shape: height is no number above 0": ["yew"]
    }
    assert len(city.trees) == 1


def test_trees_stay_where_large_polygons_are_cut_and_alone_are_refused(tmp_path):
    objects = {"yew": {"type": "SolitaryVegetationObject", "geometry": [solid()]}}
    city = read(tmp_path, model({"house": house(solid()), **objects}))
    assert (
        len(build_scene(city, latitude=50, longitude=8, options=SceneOptions(grid_size=1.0)).trees)
        == 1
    )
    with pytest.raises(
        InputError, match=r"no buildings, only vegetation \(1\); give the file with the buildings"
    ):
        read(tmp_path, model(objects))
