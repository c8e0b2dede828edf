"""Blender as a Python module, kept away from anybody's settings, and a small city to show in it.

Helpers beside these tests and beside those of the core can be imported by their names.
"""

import os
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "core"))
sys.path.insert(0, str(Path(__file__).parent))  # first: both have a test_materials
# Blender reads this when it is imported.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="citypv-blender-")

import bpy
import pytest
from small_city import surface, write_gml
from steps import run
from street import STREET, describe_house

import citypv
from citypv.core.city.build_scene import build_scene
from citypv.core.read.read_city import read_city
from citypv.core.run.study import compute_energy, read_year, trace_scene
from citypv.core.settings.request import Request
from citypv.operators.city.attributes import Faces
from citypv.operators.city.build_meshes import build_meshes, show_objects


def pytest_itemcollected(item):
    item.add_marker(pytest.mark.every_python)


@pytest.fixture(scope="session")
def city_file(tmp_path_factory):
    """A street with three houses as CityGML: 21 surfaces."""
    return write_gml(tmp_path_factory.mktemp("city") / "street.gml", *STREET)


@pytest.fixture(scope="session")
def tower_file(tmp_path_factory):
    """The street with a fourth house of its own ids, 40 m higher, to the south of the first."""
    tower = describe_house("tower", (0, -12), (10, 8, 46))
    return write_gml(tmp_path_factory.mktemp("tower") / "street_with_tower.gml", *STREET, tower)


def turn_ring(found):
    words = found[2].split()
    return (
        found[1]
        + " ".join(" ".join(words[k : k + 3]) for k in range(len(words) - 3, -1, -3))
        + found[3]
    )


@pytest.fixture(scope="session")
def row_file(tmp_path_factory):
    """Two houses wall to wall; of the second a roof faces down, and a wall is a line."""
    second, turned = re.subn(
        r"(b_roof_south.*?posList>)([^<]+)(<)", turn_ring, describe_house("b", (10, 0)), count=1
    )
    line = surface("WallSurface", "b_line", [(10, 0, 0), (15, 0, 0), (19, 0, 0)])
    second = second.replace("</bldg:Building>", line + "</bldg:Building>")
    assert turned == 1
    return write_gml(
        tmp_path_factory.mktemp("row") / "row.gml", describe_house("a", (0, 0)), second
    )


@pytest.fixture(scope="session")
def scene(city_file):
    """The street as core reads it."""
    return build_scene(read_city([city_file]))


@pytest.fixture(scope="session")
def light(scene):
    """What a quick run traced and weighed under a clear sky: a Transfer and an Energy."""
    request = Request(weather="clear-sky", samples=16, shadow_samples=2, suns="days:2", threads=1)
    weather = read_year(scene.site, request)
    transfer = trace_scene(scene, weather, request)
    return transfer, compute_energy(transfer, weather, request)


@pytest.fixture(scope="session")
def transfer(light):
    return light[0]


@pytest.fixture(scope="session")
def energy(light):
    return light[1]


@pytest.fixture
def shown(scene, transfer, energy):
    """The city and its ground in Blender's scene, with everything written on them."""
    city, ground = build_meshes(scene)
    show_objects(bpy.context.scene, city, ground)
    Faces(city, ground).write_classes(scene.surfaces)
    Faces(city, ground).write_results(transfer, energy)
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


@pytest.fixture
def traced(addon, city_file):
    """The street with its energy, to be edited."""
    return run("solar_city", city_path=str(city_file), samples=32, shadow_samples=4, days=4)
