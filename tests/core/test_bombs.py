"""Small files that unpack to large ones are refused with bounded memory, and what only looks like one is read."""

import gzip
import json
import sys

import citygml_text as text
import pytest
from cityjson_text import CUBE, FACES, house, instance, model
from memory_of_reading import memory_of_refusal

from citypv.core.read import parse_xml
from citypv.core.read.open_input import LARGEST_GAIN
from citypv.core.read.read_city import read_city

pytestmark = pytest.mark.once

GML = text.HEAD.encode()
JSON = b'{"type": "CityJSON", "version": "2.0", "CityObjects": {"a": {"type": "Building", "geometry": [['
SEQUENCE = b'{"type": "CityJSON", "version": "2.0", "vertices": []}\n'
PLACED = {str(k): house(*[instance()] * 100) for k in range(5)}
TEMPLATES = {"templates": [{"type": "MultiSurface", "lod": "2", "boundaries": [[face] for face in FACES] * 400}]}
TEMPLATES = {"geometry-templates": {**TEMPLATES, "vertices-templates": CUBE}}
BOMBS = {  # name: head, piece, how many, what is said
    "comments.gml.gz": (GML, b"<!--" + b" " * 2**20 + b"-->", 300, "decompresses to more than"),
    "lines.obj.gz": (b"v 0 0 0\n", b"#" + b" " * 1022 + b"\n", 300_000, "decompresses to more than"),
    "elements.gml.gz": (GML, b"<a/>" * 2**18, 100, "tags before the end of a building"),
    "inside.gml.gz": (GML + b"<cityObjectMember>", b"<a></a>" * 2**17, 100, "tags before the end of a building"),
    "deep.gml": (GML, b"<a>", 100_000, "nested too deeply"),
    "wide.gml": (GML + b"<a" + b"".join(b' x%d="1"' % k for k in range(10**5)) + b"/>", b"", 0, "invalid XML"),
    "lists.json.gz": (JSON, b"[]," * 2**18, 100, "too large for memory"),
    "objects.json.gz": (JSON, b'{"a":0},' * 2**17, 60, "too large for memory"),
    "numbers.json.gz": (JSON, b"1.5," * 2**18, 200, "too large for memory"),
    "rings.jsonl.gz": (SEQUENCE + JSON, b"[[0,1,2]]," * 2**18, 30, "too large for memory"),
    "word.json.gz": (b'{"type": "', b"x" * 2**20, 200, "decompresses to more than"),
    "deep.json": (JSON, b"[", 500_000, "lists nested too deeply"),
    "templates.json": (json.dumps(model(PLACED, **TEMPLATES)).encode(), b"", 0, "template instances have more than"),
}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows tells no peak of memory this way")
@pytest.mark.parametrize(
    "name", [name if name[0] != "t" else pytest.param(name, marks=pytest.mark.slow) for name in BOMBS]
)
def test_bombs_are_refused_with_bounded_memory(tmp_path, name):
    head, piece, count, said = BOMBS[name]
    with gzip.open(tmp_path / name, "wb") if name.endswith(".gz") else (tmp_path / name).open("wb") as packed:
        packed.write(head)
        for _ in range(count):
            packed.write(piece)
    if said.startswith("decompresses"):
        assert LARGEST_GAIN * (tmp_path / name).stat().st_size < count * len(piece)
    problem, grown = memory_of_refusal(tmp_path / name)
    assert said in problem
    assert grown < (1 if "json" in name else 1.2) * 2**30


def test_a_long_row_of_other_objects_is_no_bomb(tmp_path, monkeypatch):
    monkeypatch.setattr(parse_xml, "MOST_TAGS", 20_000)
    other = "<cityObjectMember><veg/><veg/><veg/></cityObjectMember>" * 2**13
    house_of_text = text.building(text.surface(text.members(text.polygon("a", text.SQUARE))))
    (tmp_path / "city.gml").write_text(f"{text.HEAD}{other}{house_of_text}</CityModel>", encoding="utf-8")
    assert len(read_city(tmp_path / "city.gml")) == 1
