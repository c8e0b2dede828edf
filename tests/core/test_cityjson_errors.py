"""CityJSON that cannot be used: refused with file, place and cure, or skipped piece by piece with a
reason.
"""

import copy
import json

import numpy as np
import pytest
from cityjson_text import CUBE, SHELL, house, instance, model, read, solid
from test_citygml_rules import assert_refused
from thorough import THOROUGH

from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python

GOOD = model({"b": house(solid())})
TEXT = json.dumps(GOOD)
HEAD = {key: value for key, value in model({}, []).items() if key != "CityObjects"}
FEATURE = {**model({"b": house(solid())}), "type": "CityJSONFeature"}


def scaled(*scale):
    return json.dumps({**GOOD, "transform": {"scale": scale, "translate": [0] * 3}})


BAD_DOCUMENTS = {
    "empty": ("", "empty"),
    "blank": (" \n\n", "nothing but whitespace"),
    "cut": (TEXT[:200], r"line 1, column \d+: invalid JSON"),
    "cut on several lines": (
        json.dumps(GOOD, indent=1)[:200],
        r"line \d\d, column \d+: invalid JSON",
    ),
    "cut in a sequence": (
        "\n".join(map(json.dumps, (HEAD, FEATURE)))[:-5],
        r"line 2, column \d+: invalid JSON",
    ),
    "no json": ("hello", "line 1, column 1: this is not JSON"),
    "geojson": ('{"type": "FeatureCollection"}', "line 1: features is not a list"),
    "a feature alone": ('{"type": "CityJSONFeature"}', "put the header object"),
    "old": (json.dumps({**GOOD, "version": "0.9"}), "version '0.9'; give CityJSON 1.0 to 2.0"),
    "new": (json.dumps({**GOOD, "version": "3.0"}), "version '3.0'"),
    "deep": (TEXT[:-1] + ', "x": ' + "[" * 200_000 + "}", "nested too deeply"),
    "NaN": (
        TEXT.replace("[2, 0, 0]", "[NaN, 0, 0]"),
        "line 1: vertex 1 of vertices is not finite or beyond",
    ),
    "infinite scale": (scaled(1, 1, -np.inf), "three numbers each"),
    "digits": (
        TEXT.replace("[2, 0, 0]", f"[{'9' * 5000}, 0, 0]"),
        "line 1: a number with thousands of digits",
    ),
    "400 digits": (
        TEXT.replace("[2, 0, 0]", f"[{'9' * 400}, 0, 0]"),
        "vertex 1 of vertices is not finite or beyond",
    ),
    "words": (
        TEXT.replace("[2, 0, 0]", '["2", "0", "0"]'),
        "vertex 1 of vertices is not three numbers",
    ),
    "true": (
        TEXT.replace("[2, 0, 0]", "[true, 0, 0]"),
        "vertex 1 of vertices is not three numbers",
    ),
    "no vertices": (json.dumps({**GOOD, "vertices": {}}), "vertices is not a list"),
    "overflow": (scaled(9e7, 9e7, 9e7), "vertex 1 of vertices"),
    "transform": (scaled(1, 1), "transform needs three numbers each for scale"),
    "flat": (scaled(1, 0, 1), "none 0"),
    "objects": (json.dumps({**GOOD, "CityObjects": []}), "CityObjects is not a JSON object"),
    "twice": (TEXT[:-1] + ', "vertices": []}', "line 1: vertices is given twice"),
    "long attribute": ('{"a": "' + "x" * 11_000_000, "line 1, column"),
    "no such vertices": (
        json.dumps({**GOOD, "vertices": []}),
        "no building has usable .*vertex index out of range",
    ),
    "blank lines": (json.dumps(HEAD) + "\n" * 150_000, "contains no buildings"),
}


@pytest.mark.parametrize("name", BAD_DOCUMENTS)
def test_refused_with_file_place_and_cure(tmp_path, name):
    text, problem = BAD_DOCUMENTS[name]
    (tmp_path / "city.json").write_text(text, encoding="utf-8")
    assert_refused(tmp_path / "city.json", problem, 400)


BAD_PIECES = {
    "vertex index out of range": {"boundaries": [[[[0, 1, 99]]]]},
    "vertex index is not an integer": {"boundaries": [[[[0, True, 1.5]]]]},
    "surface is not a list of rings": {"boundaries": [[[0, 1, 2]]]},
    "surface without an exterior ring": {"boundaries": [[[]]]},
    "boundaries not nested as required by the geometry type": {"boundaries": [7]},
    "invalid level of detail": {"lod": "good"},
    "Blob: no surfaces": {"type": "Blob"},
    "MultiPoint: no surfaces": {"type": "MultiPoint"},
    "inner shell of a solid: cavities receive no light": {"boundaries": [SHELL[:5], SHELL[:1]]},
    "interior surface": {
        "semantics": {"surfaces": [{"type": "FloorSurface"}], "values": [[0] + [None] * 5]}
    },
    "instance of a template that is not in the file": {**instance(), "template": 4},
    "instance with a missing reference point or an invalid matrix": {
        **instance(),
        "boundaries": [99],
    },
}


@pytest.mark.parametrize("reason", BAD_PIECES)
def test_pieces_that_cannot_be_used_are_reported(tmp_path, reason):
    objects = {"good": house(solid()), "bad": house(solid(**BAD_PIECES[reason]))}
    templates = {"templates": [solid()], "vertices-templates": CUBE}
    report = read(tmp_path, model(objects, **{"geometry-templates": templates})).report
    assert [name.split(",")[0] for name in report.skipped[reason]] == ["bad"]


WRONG = [None, True, -1, 1e308, 10**400, "x", [], {"type": []}]
FULL = model(
    {
        "b": house(
            solid(semantics={"surfaces": [{"type": "RoofSurface", "id": "r"}], "values": [[0] * 6]})
        ),
        "p": house(instance(), solid(), kind="BuildingPart", parents=["b"], attributes={"a": 1}),
    },
    transform={"scale": [1, 1, 1], "translate": [0, 0, 0]},
    metadata={"referenceSystem": "EPSG:25833", "crs": {"epsg": 25833}},
    **{"geometry-templates": {"templates": [solid()], "vertices-templates": CUBE}},
)


def places(node, path=()):
    """Every place in a document, the first two members of each list standing for all."""
    yield path
    inside = (
        node.items()
        if isinstance(node, dict)
        else enumerate(node[:2])
        if isinstance(node, list)
        else ()
    )
    for key, value in inside:
        yield from places(value, (*path, key))


@pytest.mark.slow
def test_a_wrong_value_anywhere_ends_in_a_city_or_in_one_line(tmp_path):
    outcomes = []
    for number, (*way, last) in enumerate(path for path in places(FULL) if path):
        for wrong in WRONG if THOROUGH else WRONG[number % 2 :: 2]:
            document = copy.deepcopy(FULL)
            node = document
            for key in way:
                node = node[key]
            node[last] = wrong
            try:
                assert np.isfinite(read(tmp_path, document).points).all()
                outcomes.append(True)
            except InputError as error:
                assert len(str(error).splitlines()) == 1
                outcomes.append(False)
    assert len(outcomes) > 200
    assert 0.1 < np.mean(outcomes) < 0.95


def test_a_name_given_twice_is_reported(tmp_path):
    doubled = TEXT.replace('"b": {', '"b": ' + json.dumps(house(solid())) + ', "b": {')
    (tmp_path / "city.json").write_text(doubled, encoding="utf-8")
    report = read_city(tmp_path / "city.json").report
    assert report.skipped == {"city object whose name is used again later in the file": ["b"]}


def test_names_of_any_kind_fit_into_a_line(tmp_path):
    ids = {
        "surfaces": [{"type": "RoofSurface", "id": "two\nlines"}],
        "values": [[0, None, None, None, None, None]],
    }
    objects = {"a\nb\u2028": house(solid(semantics=ids)), "x" * 10_000: house(kind="Tree\n" * 100)}
    objects["x" * 10_001] = house(solid(), kind="BuildingPart", parents=["none"])
    objects["half \ud800"] = house(solid(semantics=ids))
    metadata = {"referenceSystem": "EPSG:\ud800\x00"}
    city = read(tmp_path, model(objects, metadata=metadata))
    texts = [*city.surface_id, *city.building_id, *city.report.notes]
    assert all(text.isprintable() and len(text) < 400 for text in texts)
    assert {len(name) for name in city.building_id} == {4, 6, 200}
