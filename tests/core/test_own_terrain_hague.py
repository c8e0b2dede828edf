"""Relief and buildings of one real file: eight houses of The Hague on their own terrain."""

import gzip
import re
from pathlib import Path

import numpy as np
import pytest
from reliefs import only, told
from test_own_terrain import heights_of_scene

from citypv.core.city.build_scene import build_scene
from citypv.core.city.terrain import measure_heights
from citypv.core.read.read_city import read_city

HAGUE = Path(__file__).parents[1] / "data" / "citygml" / "denhaag_cut_with_relief.gml.gz"


@pytest.mark.once
def test_eight_houses_of_the_hague():
    """Heights of the real TIN at random places, by barycentric coordinates of the text's own triangles."""
    text = gzip.decompress(HAGUE.read_bytes()).decode("utf-8")
    tags = re.findall(r"<gml:Triangle>.*?<gml:posList[^>]*>([^<]*)<", text, re.DOTALL)
    corners = np.array([np.array(tag.split(), float).reshape(4, 3)[:3] for tag in tags])
    city = read_city(HAGUE)
    assert city.report.building_count == text.count("<bldg:Building ") == 8
    assert len(only(city).triangles) == len(corners) == 719
    rng = np.random.default_rng(5)
    size = 0.5 * np.linalg.norm(np.cross(*(corners[:, 1:] - corners[:, :1]).transpose(1, 0, 2))[:, 2:], axis=1)
    chosen = rng.choice(np.flatnonzero(size > 0.5), 300)
    share = rng.dirichlet([1.0, 1.0, 1.0], 300)
    places = (share[:, :, None] * corners[chosen]).sum(axis=1)
    assert np.abs(measure_heights(city.terrain, places[:, :2]) - places[:, 2]).max() < 1e-5
    scene = build_scene(city)
    assert told(scene, "Ground: terrain of the file: 719 triangles.")
    middle = 0.5 * (city.points.min(axis=0) + city.points.max(axis=0))[:2]
    near = np.abs(places[:, :2] - middle).max(axis=1) < 45
    off = np.abs(heights_of_scene(scene, places[near, :2]) - places[near, 2])
    assert np.nanmedian(off) < 0.1
    assert len(build_scene(city, ground="feet").surfaces) == len(scene.surfaces) == len(city)
