"""Blender as a Python module, kept away from anybody's settings, and a small city to show in it."""

import os
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
# Blender reads this when it is imported.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="citypv-blender-")

import bpy
import numpy as np
import pandas as pd
import pytest
from steps import run

import citypv
from citypv.core.city.build_scene import build_scene
from citypv.core.energy.energy import Energy
from citypv.core.light.transfer import Transfer
from citypv.core.read.read_city import read_city
from citypv.core.sun.suns import Suns
from citypv.operators.attributes import write_classes, write_results
from citypv.operators.city.build_meshes import build_meshes, show_objects

EAST, NORTH = 391500.0, 5817800.0  # Berlin, EPSG:25833
POLYGON = (
    "<bldg:boundedBy><bldg:{name}><bldg:lod2MultiSurface><gml:MultiSurface><gml:surfaceMember>"
    '<gml:Polygon gml:id="{id}"><gml:exterior><gml:LinearRing><gml:posList>{points}</gml:posList></gml:LinearRing>'
    "</gml:exterior></gml:Polygon></gml:surfaceMember></gml:MultiSurface></bldg:lod2MultiSurface></bldg:{name}></bldg:boundedBy>"
)
CITY = (
    '<?xml version="1.0" encoding="UTF-8"?><CityModel xmlns="http://www.opengis.net/citygml/2.0" '
    'xmlns:gml="http://www.opengis.net/gml" xmlns:bldg="http://www.opengis.net/citygml/building/2.0">'
    '<gml:boundedBy><gml:Envelope srsName="EPSG:25833" srsDimension="3"><gml:lowerCorner>0 0 0</gml:lowerCorner>'
    "<gml:upperCorner>1 1 1</gml:upperCorner></gml:Envelope></gml:boundedBy>{houses}</CityModel>"
)


def describe_house(name, x, y, size=(10.0, 8.0, 6.0), ridge=3.0):
    """Write a house with a gable roof: 7 surfaces; the ridge runs from west to east."""
    width, depth, height = size
    a, b, c, d = (x, y), (x + width, y), (x + width, y + depth), (x, y + depth)
    low, eave, top = 35.0, 35.0 + height, 35.0 + height + ridge
    west, east = (x, y + depth / 2, top), (x + width, y + depth / 2, top)
    surfaces = {
        "GroundSurface": [[(*p, low) for p in (a, d, c, b)]],
        "WallSurface": [
            [(*a, low), (*b, low), (*b, eave), (*a, eave)],
            [(*b, low), (*c, low), (*c, eave), east, (*b, eave)],
            [(*c, low), (*d, low), (*d, eave), (*c, eave)],
            [(*d, low), (*a, low), (*a, eave), west, (*d, eave)],
        ],
        "RoofSurface": [[(*a, eave), (*b, eave), east, west], [(*c, eave), (*d, eave), west, east]],
    }
    text = ""
    for theme, rings in surfaces.items():
        for number, ring in enumerate(rings):
            points = " ".join(f"{value:.3f}" for point in [*ring, ring[0]] for value in point)
            text += POLYGON.format(name=theme, id=f"{name}_{theme}_{number}", points=points)
    return f'<cityObjectMember><bldg:Building gml:id="{name}">{text}</bldg:Building></cityObjectMember>'


def describe_street():
    """Three houses."""
    return [describe_house(f"house{i}", EAST + x, NORTH + y) for i, (x, y) in enumerate(((0, 0), (14, 0), (2, 22)))]


def write_city(folder, name, houses):
    path = folder / name
    path.write_text(CITY.format(houses="".join(houses)), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def city_file(tmp_path_factory):
    """A street with three houses as CityGML: 21 surfaces."""
    return write_city(tmp_path_factory.mktemp("city"), "street.gml", describe_street())


@pytest.fixture(scope="session")
def tower_file(tmp_path_factory):
    """The street with a fourth house of its own ids, 40 m higher, to the south of the first."""
    tower = describe_house("tower", EAST, NORTH - 12, (10.0, 8.0, 46.0))
    return write_city(tmp_path_factory.mktemp("tower"), "street_with_tower.gml", [*describe_street(), tower])


def turn_ring(found):
    words = found[2].split()
    return found[1] + " ".join(" ".join(words[k : k + 3]) for k in range(len(words) - 3, -1, -3)) + found[3]


@pytest.fixture(scope="session")
def row_file(tmp_path_factory):
    """Two houses wall to wall; of the second a roof faces down, and a wall is a line."""
    first, second = (describe_house(name, EAST + x, NORTH) for name, x in (("a", 0.0), ("b", 10.0)))
    second, turned = re.subn(r"(b_RoofSurface_0.*?posList>)([^<]+)(<)", turn_ring, second, count=1)
    line = re.search(r"<bldg:boundedBy>.*?</bldg:boundedBy>", second)[0]
    x, y = EAST + 10, NORTH
    flat = re.sub(r"posList>[^<]+<", f"posList>{x} {y} 35 {x + 5} {y} 35 {x + 9} {y} 35 {x} {y} 35<", line)
    second = second.replace(line, line + flat.replace("b_GroundSurface_0", "b_line"))
    assert turned == 1
    assert "b_line" in second
    return write_city(tmp_path_factory.mktemp("row"), "row.gml", [first, second])


@pytest.fixture(scope="session")
def scene(city_file):
    """The street as core reads it."""
    return build_scene(read_city([city_file]))


@pytest.fixture(scope="session")
def transfer(scene):
    """Numbers that name their surface, as if they had been traced."""
    count = len(scene.surfaces)
    random = np.random.default_rng(1)
    suns = Suns("hourly", np.array([[0.0, -0.6, 0.8]]), np.ones(1), np.zeros(1, np.int32), np.zeros(1, np.int32))
    return Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns,
        covered_share=np.zeros(count),
        sky_view_factor=random.random(count),
        far_ground_view_factor=np.zeros(count),
        ground_albedo=0.25,
        diffuse_relative=random.random(count),
        diffuse_relative_standard_error=np.full(count, 0.01),
        visible_share=np.ones((count, 1), np.float32),
        direct_reflected=np.zeros((count, 1), np.float32),
        direct_annual_standard_error=np.full(count, 0.01),
    )


@pytest.fixture(scope="session")
def energy(scene):
    """Numbers that name their surface, as if a year had been weighed; none for ground and downward surfaces."""
    surfaces = scene.surfaces
    count, random = len(surfaces), np.random.default_rng(2)
    idle = np.isin(surfaces.kind, ["ground", "downward"])
    hours = np.where(idle, np.nan, 300 + 900 * random.random(count))
    return Energy(
        direct_relative_annual=random.random(count),
        direct_relative_annual_standard_error=np.full(count, 0.01),
        poa_global_annual=1000 * random.random(count),
        full_load_hours=hours,
        full_load_hours_dc=1.2 * hours,
        full_load_hours_standard_error=np.where(idle, np.nan, 5 * random.random(count)),
        full_load_hours_by_month=np.outer(hours, np.full(12, 1 / 12)),
        full_load_hours_by_year=np.zeros((count, 0)),
        times=pd.date_range("2021-01-01", periods=4, freq="h", tz="UTC"),
        interval=pd.Timedelta("1h"),
        groups=[("facade", "south")],
        group_count=np.array([3]),
        group_area=np.array([180.0]),
        group_standard_error=np.array([1.0]),
        group_dc=np.array([900.0]),
        sampling_error=1.0,
        capacity_factor=np.full((4, 1), 0.25),
        years=1.0,
        longitude=13.4,
        eligible=surfaces.eligible,
        flat_roof=np.zeros(count, bool),
        open_area=surfaces.area,
        counted_area=np.where(surfaces.eligible, surfaces.area, 0.0),
        module_area=np.where(surfaces.eligible, surfaces.area, 0.0),
    )


@pytest.fixture
def shown(scene, transfer, energy):
    """The city and its ground in Blender's scene, with everything written on them."""
    city, ground = build_meshes(scene)
    show_objects(bpy.context.scene, city, ground)
    write_classes(city, ground, scene.surfaces)
    write_results(city, ground, transfer, energy)
    return city, ground


@pytest.fixture(autouse=True)
def empty_blender():
    """Every test begins in an empty file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@pytest.fixture
def addon():
    """The add-on, enabled as Python enables it; returns its settings."""
    citypv.register()
    yield bpy.context.scene.citypv
    citypv.unregister()


@pytest.fixture
def city(addon, city_file):
    """The street with its energy."""
    return run("solar_city", city_path=str(city_file), samples=16, shadow_samples=2, days=2)
