"""Rules of CityJSON one by one: families, twins, semantics, templates, transforms and sequences of
features.
"""

import json

import pytest
from cityjson_text import CUBE, FACES, at, house, instance, model, read, row, solid

from citypv.core.read.read_city import read_city

pytestmark = pytest.mark.every_python

ROOF = {"surfaces": [{"type": "RoofSurface"}]}


def head(**more):
    return {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [1] * 3, "translate": [0] * 3},
        **more,
    }


def feature(name, step=0, **more):
    vertices = [[x + 10 * step, y, z] for x, y, z in CUBE]
    return {
        "type": "CityJSONFeature",
        "CityObjects": {name: house(solid())},
        "vertices": vertices,
        **more,
    }


def read_lines(tmp_path, *texts, indent=None, name="city.jsonl"):
    (tmp_path / name).write_text(
        "\n".join(json.dumps(text, indent=indent) for text in texts), encoding="utf-8"
    )
    return read_city(tmp_path / name)


def test_a_part_of_a_part_belongs_to_the_building_at_the_top(tmp_path):
    """A group is no building, whatever it names."""
    objects = {
        "g": {"type": "CityObjectGroup", "children": ["b"]},
        "q": house(at(1), kind="BuildingPart", parents=["p"]),
        "p": house(at(0), kind="BuildingPart", parents=["b"], children=["q"]),
        "b": house(children=["p"], parents=["g"]),
    }
    city = read(tmp_path, model(objects, row(2)))
    assert set(city.building_id) == {"b"}
    assert (city.report.building_count, city.report.part_count) == (1, 2)
    assert "1 CityObjectGroup left out: not a building." in city.report.notes


@pytest.mark.parametrize("parents", [["nowhere", "b"], None])
def test_a_building_names_its_part_where_the_part_does_not(tmp_path, parents):
    objects = {
        "b": house(children=["p"]),
        "p": house(solid(), kind="BuildingPart", parents=parents),
    }
    city = read(tmp_path, model(objects))
    assert set(city.building_id) == {"b"}
    assert city.report.building_count == 1


def test_parents_in_a_circle_or_missing_are_noted(tmp_path):
    objects = {
        "a": house(solid(), kind="BuildingPart", parents=["b"]),
        "b": house(kind="BuildingPart", parents=["a"]),
        "c": house(solid(), kind="BuildingPart", parents=["nowhere"]),
        "d": house(solid(), kind="BuildingInstallation", parents=["c"]),
    }
    city = read(tmp_path, model(objects))
    words = "3 parts or installations have no parent building; they are read as buildings: a, b, c"
    assert words in city.report.notes
    assert set(city.building_id) == {"a", "c"}


def test_types_of_extensions(tmp_path):
    objects = {
        "a": house(at(0), kind="+NoiseBuilding"),
        "p": house(at(1), kind="+NoiseBuildingPart", parents=["a"]),
        "r": house(at(0), kind="+BuildingRoomZ", parents=["a"]),
        "z": house(at(2), kind="BuildingZ"),
        "n": house(kind="BuildingZ"),
        "t": house(at(0), kind="+Tree"),
    }
    city = read(tmp_path, model(objects, row(3)))
    assert city.building_id == ["a"] * 12 + ["z"] * 6
    kept = ["1 +NoiseBuilding (extension type) read as", "1 BuildingZ (extension type) read as"]
    for words in (*kept, "1 BuildingZ left out", "1 +BuildingRoomZ left"):
        assert any(note.startswith(words) for note in city.report.notes)


def test_several_drawings_of_one_kind_belong_together_and_parts_drawn_in_different_ways_are_no_twins(
    tmp_path,
):
    semantics = {**ROOF, "values": [0, 0, 0]}
    drawings = [
        {
            "type": "MultiSurface",
            "lod": "2",
            "boundaries": [[FACES[k]] for k in numbers],
            "semantics": semantics,
        }
        for numbers in ([0, 1, 2], [3, 4, 5])
    ]
    city = read(tmp_path, model({"b": house(*drawings)}))
    assert len(city) == 6 and not city.report.skipped
    other = {"type": "MultiSurface", "lod": "2", "boundaries": at(1)["boundaries"][0]}
    objects = {
        "b": house(children=["p", "q"]),
        "p": house(at(0), kind="BuildingPart", parents=["b"]),
        "q": house(other, kind="BuildingPart", parents=["b"]),
    }
    assert len(read(tmp_path, model(objects, row(2)))) == 12


@pytest.mark.parametrize("first", [0, 1, 2])
def test_semantics_tell_which_twin_is_kept(tmp_path, first):
    """Each drawing stands a millimetre beside the others, so that none is the same point
    for point.
    """
    drawings = [
        {**at(0), "semantics": {**ROOF, "values": [[0] * 6]}},
        {
            "type": "MultiSurface",
            "lod": "2",
            "boundaries": at(1)["boundaries"][0],
            "semantics": {**ROOF, "values": []},
        },
        at(2),
    ]
    turned = drawings[first:] + drawings[:first]
    vertices = [[x + 1e-3 * k, y, z] for k in range(3) for x, y, z in CUBE]
    city = read(tmp_path, model({"b": house(*turned)}, vertices))
    assert len(city) == 6
    assert city.points[:, 0].min() == 0.0
    assert city.thematic == ["RoofSurface"] * 6


# nested as the shells, flat, short, long, one for a shell, none, numbers that name nothing
VALUES = {
    "nested": ([[0, 0, None, 1, 1, 1]], "RR_WWW", False),
    "flat": ([0, 0, None, 1, 1, 1], "______", True),
    "short": ([[0, 1]], "RW____", True),
    "long": ([[0, 0, None, 1, 1, 1, 1]], "RR_WWW", True),
    "null": ([None], "______", False),
    "number": ([0], "______", True),
    "none": (None, "______", False),
    "unknown": ([[-1, 2, True, 1.0, "0", 0]], "_____R", True),
}


@pytest.mark.parametrize("name", VALUES)
def test_values_of_semantics(tmp_path, name):
    values, letters, noted = VALUES[name]
    semantics = {"surfaces": [{"type": "RoofSurface"}, {"type": "WallSurface"}], "values": values}
    city = read(tmp_path, model({"b": house(solid(semantics=semantics))}))
    words = {"R": "RoofSurface", "W": "WallSurface", "_": ""}
    assert city.thematic == [words[letter] for letter in letters]
    assert any("semantics that do not match" in note for note in city.report.notes) == noted


@pytest.mark.parametrize(("lod", "text"), [(2.0, "2"), (2.2, "2.2"), ("1.3", "1.3"), (1, "1")])
def test_lod_as_number_or_text(tmp_path, lod, text):
    assert read(tmp_path, model({"b": house(solid(lod=lod))})).report.lods_chosen == {text: 6}


def test_without_lod_a_shape_is_read_where_there_is_no_other(tmp_path):
    bare = {key: value for key, value in at(1).items() if key != "lod"}
    city = read(tmp_path, model({"a": house(solid(), bare), "b": house(bare)}, row(2)))
    assert city.report.lods_chosen == {"": 6, "2": 6}
    assert any("give no level of detail" in note for note in city.report.notes)


def test_a_transform_scales_and_moves(tmp_path):
    vertices = [[1000 * x, 1000 * y, 1000 * z] for x, y, z in CUBE]
    transform = {"scale": [0.001, 0.002, 0.001], "translate": [10, 20, 30]}
    city = read(tmp_path, model({"b": house(solid())}, vertices, transform=transform))
    assert city.points.min(axis=0).tolist() == [10, 20, 30]
    assert city.points.max(axis=0) == pytest.approx([12, 24, 32])
    assert not city.report.notes
    vertices[0][0] = 0.5
    notes = read(tmp_path, model({"b": house(solid())}, vertices, transform=transform)).report.notes
    assert any("not integers" in note for note in notes)


@pytest.mark.parametrize(
    ("indent", "name"), [(None, "city.json"), (1, "city.jsonl"), (None, "city.city.jsonl")]
)
def test_a_sequence_in_any_layout(tmp_path, indent, name):
    city = read_lines(tmp_path, head(), feature("a"), feature("b", 1), indent=indent, name=name)
    assert city.building_id == ["a"] * 6 + ["b"] * 6
    assert city.points[:, 0].max() == 12


def test_a_feature_with_templates_of_the_head(tmp_path):
    templates = {"templates": [solid()], "vertices-templates": CUBE}
    own = {**feature("a"), "CityObjects": {"a": house(instance(corner=7))}}
    city = read_lines(tmp_path, head(**{"geometry-templates": templates}), own)
    assert city.points.min(axis=0).tolist() == CUBE[7]


def test_features_of_one_name(tmp_path):
    again = read_lines(
        tmp_path, head(), feature("a"), feature("b", 1), feature("a"), feature("b", 2)
    )
    assert again.building_id == ["a"] * 6 + ["b"] * 6 + ["b~2"] * 6
    assert again.report.skipped == {"building already read": ["a"]}
    assert any("number added: b~2" in note for note in again.report.notes)


def test_bytes_that_are_not_utf8_are_noted(tmp_path):
    text = json.dumps(model({"Straße": house(solid())}), ensure_ascii=False)
    (tmp_path / "city.json").write_bytes(text.encode("latin-1"))
    city = read_city(tmp_path / "city.json")
    assert set(city.building_id) == {"Stra\ufffde"}
    assert any("not UTF-8" in note for note in city.report.notes)


def test_a_folder_gives_its_cityjson_and_no_other_json(tmp_path):
    read_lines(tmp_path, head(), feature("a"), name="a.jsonl")
    read(tmp_path, model({"b": house(at(1))}, row(2)))
    (tmp_path / "package.json").write_text('{"type": "module"}', encoding="utf-8")
    (tmp_path / "wide.json").write_bytes(
        json.dumps(model({"c": house(at(2))}, row(3))).encode("utf-16")
    )
    assert sorted(set(read_city(tmp_path).building_id)) == ["a", "b", "c"]
