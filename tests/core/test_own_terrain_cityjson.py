"""TINRelief of CityJSON and CityJSONSeq as the ground of its own city."""

import json

import numpy as np
import pytest
from cityjson_text import CUBE, house, model, solid
from reliefs import only, told
from thorough import mark_cases

from citypv.core.city.build_scene import build_scene
from citypv.core.city.terrain import measure_heights
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python


def cube_on_relief(boundaries, vertices, **more):
    surface = {"type": "CompositeSurface", "lod": "2", "boundaries": boundaries}
    return {"cube": house(solid()), "tin": {"type": "TINRelief", "geometry": [surface], **more}}, [
        *CUBE,
        *vertices,
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sequence", "quad"),
    mark_cases([(False, True), (True, False), (False, False), (True, True)], kept=2),
)
def test_relief_of_cityjson(tmp_path, sequence, quad):
    """A plane of slope 0.25 towards the east, of triangles or of one square; with a transform."""
    corners = [[-40, -40, -10], [40, -40, 10], [40, 40, 10], [-40, 40, -10]]
    boundaries = [[[8, 9, 10, 11]]] if quad else [[[8, 9, 10]], [[8, 10, 11]]]
    objects, vertices = cube_on_relief(boundaries, corners)
    transform = {"scale": [0.5, 0.5, 0.5], "translate": [1000.0, 2000.0, 10.0]}
    if sequence:
        head = {**model({}, []), "transform": transform}
        common = {"type": "CityJSONFeature", "vertices": vertices}
        rows = [common | {"id": name, "CityObjects": {name: one}} for name, one in objects.items()]
        text = "\n".join(json.dumps(row) for row in (head, *rows))
    else:
        text = json.dumps(model(objects, vertices, transform=transform))
    path = tmp_path / ("city.jsonl" if sequence else "city.json")
    path.write_text(text, encoding="utf-8")
    city = read_city(path)
    assert len(city) == 6
    assert not any("TINRelief" in note for note in city.report.notes)
    assert len(only(city).triangles) == 2
    places = np.random.default_rng(4).uniform(-19, 19, (200, 2))
    found = measure_heights(city.terrain, places + np.array([1000.0, 2000.0]))
    assert found == pytest.approx(10.0 + 0.25 * places[:, 0], abs=1e-9)
    assert told(build_scene(city, 50.0, 8.0), "Ground: terrain of the file: 2 triangles.")


def test_relief_of_cityjson_that_cannot_be_used(tmp_path):
    objects, vertices = cube_on_relief(
        [[[8, 9]], [[8, 9, 99]], [[8, 9, 10]]], [[-9, -9, 0], [9, -9, 0], [9, 9, 0]]
    )
    objects["points"] = {
        "type": "TINRelief",
        "geometry": [{"type": "MultiPoint", "lod": "1", "boundaries": [8]}],
    }
    (tmp_path / "city.json").write_text(json.dumps(model(objects, vertices)), encoding="utf-8")
    city = read_city(tmp_path / "city.json")
    assert len(only(city).triangles) == 1
    assert {reason: len(names) for reason, names in city.report.skipped.items()} == {
        "terrain surface that is not a triangle with heights": 1,
        "vertex index out of range": 1,
        "MultiPoint: no surfaces": 1,
    }
    del objects["cube"]
    (tmp_path / "city.json").write_text(json.dumps(model(objects, vertices)), encoding="utf-8")
    with pytest.raises(InputError, match="contains no buildings"):
        read_city(tmp_path / "city.json")
