"""Whatever a file holds, reading it ends in a city or in one line: real files spoilt, and bombs."""

import gzip
import json
import random
import re
import sys
from pathlib import Path

import citygml_text as text
import numpy as np
import pytest
from cityjson_text import CUBE, FACES, house, instance, model
from memory_of_reading import memory_of_refusal
from thorough import draw_count, mark_cases

from citypv.core.city.build_scene import build_scene
from citypv.core.read import collect_shapes, parse_xml
from citypv.core.read.open_input import LARGEST_GAIN
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

DATA = Path(__file__).parents[1] / "data"
REAL = {
    ".gml": ("citygml/lyon_1er_small_house.gml", "obj/nonmanifold.gml"),
    ".obj": (
        "obj/cube.obj",
        "obj/twocubes.obj",
        "obj/duplicatevertices.obj",
        "obj/nonmanifold.obj",
    ),
    ".json": tuple(
        f"cityjson/{name}*.json"
        for name in ("minimal", "multisolid", "hierarchy", "numeric_lod", "wkb")
    ),
    ".jsonl": ("cityjson/denhaag*.jsonl", "cityjson/fcb*.jsonl"),
}
WALL = text.surface(text.members(text.polygon("a", text.SQUARE)))
TOKENS = [
    b"nan",
    b"1e308",
    b"-1e400",
    b"inf",
    b"0",
    b"-1",
    b"99999999999999999999",
    b"1.5e",
    b"\x00",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"<![CDATA[",
    b"&a;",
    b"&#0;",
    b"</",
    b"<",
    b">",
    b"/>",
    b"<!--",
    b"<?x?>",
    b'xmlns:a="b" ',
    b'srsName="EPSG:4326" ',
    b'srsName="EPSG:25833" ',
    b'srsName="x" ',
    b'srsDimension="2" ',
    b'xlink:href="#a" ',
    b"[",
    b"]",
    b"{",
    b"}",
    b",",
    b'"',
    b"null",
    b"true",
    b"{}",
    b"[]",
    b"\\",
    b"\n",
    b" ",
    b"f 1 2 3\n",
    b"v 1 2 3\n",
    b"o a\n",
    b"g a\n",
    b"#",
    b"/",
    b"\xc3",
]


def spoilt_seeds(suffix):
    """Small real files of a format, at most 24 kB each; CityGML in metres and degrees, too."""
    names = [path for pattern in REAL[suffix] for path in sorted(DATA.glob(pattern))]
    seeds = [path.read_bytes() for path in names if path.stat().st_size < 24_000]
    for system in ("EPSG:25833", "EPSG:4326", "EPSG:6697") if suffix == ".gml" else ():
        envelope = f'<gml:boundedBy><gml:Envelope srsName="{system}"/></gml:boundedBy>'
        seeds.append(
            text.model(
                envelope, text.building(WALL, name="a"), text.building(WALL, name="ä")
            ).encode()
        )
    return seeds


def read_safely(folder, data, suffix):
    """A city whose points are finite, or one line that names the file and a cure; True for
    a city.
    """
    path = folder / f"city{suffix}"
    path.write_bytes(data)
    try:
        city = read_city(path)
        assert np.isfinite(city.points).all()
        assert len(city) > 0
        scene = build_scene(city, 50.0, 8.0, ground="none", patch_size=None)
        assert np.isfinite(scene.vertices).all()
    except InputError as error:
        assert len(str(error).splitlines()) == 1
        assert len(str(error)) < 700
        assert "; " in str(error)
        return False
    return True


def spoil(data, rng):
    """A real file with up to six of its pieces cut, doubled, swapped, overwritten or filled with a
    token.
    """
    for _ in range(rng.randint(1, 6)):
        first, last = sorted(rng.randint(0, len(data)) for _ in range(2))
        last = min(last, first + rng.choice([1, 3, 20, 200, 10**6]))
        token, bit = rng.choice(TOKENS), 1 << rng.randint(0, 7)
        pieces = (
            data[:first] + data[last:],
            data[:first] + token + data[first:],
            data[:first] + token + data[first + len(token) :],
            data[:last] + data[first:last] + data[last:],
            data[:first],
            data[:first]
            + bytes(byte ^ bit for byte in data[first : first + 1])
            + data[first + 1 :],
            data[:first]
            + re.sub(rb"[0-9][0-9.+e-]*", lambda _, token=token: token, data[first:], count=1),
        )
        data = rng.choice(pieces)[:60_000]
    return data


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suffix", "count"),
    mark_cases([(".gml", 4000), (".obj", 4000), (".json", 1000), (".jsonl", 500)], kept=2),
)
def test_real_files_spoilt(tmp_path, suffix, count):
    """Both ends, a city and a refusal, are reached by at least a hundredth of the files."""
    seeds, rng = spoilt_seeds(suffix), random.Random(1)
    drawn = (spoil(rng.choice(seeds), rng) for _ in range(draw_count(count, count // 8)))
    outcomes = [read_safely(tmp_path, data, suffix) for data in drawn]
    assert 0.01 < np.mean(outcomes) < 0.99


# -- small files that unpack to large ones are refused; what only looks like one is read --

GML = text.HEAD.encode()
JSON = (
    b'{"type": "CityJSON", "version": "2.0", "CityObjects": {"a": {"type": "Building", "geometry": '
    b"[["
)
SEQUENCE = b'{"type": "CityJSON", "version": "2.0", "vertices": []}\n'
TEMPLATES = {
    "templates": [
        {"type": "MultiSurface", "lod": "2", "boundaries": [[face] for face in FACES] * 400}
    ]
}
TEMPLATES = {"geometry-templates": {**TEMPLATES, "vertices-templates": CUBE}}
BOMBS = {  # name: head, piece, how many, what is said
    "comments.gml.gz": (GML, b"<!--" + b" " * 2**20 + b"-->", 300, "decompresses to more than"),
    "lines.obj.gz": (
        b"v 0 0 0\n",
        (b"#" + b" " * 1022 + b"\n") * 2**10,
        300,
        "decompresses to more than",
    ),
    "elements.gml.gz": (GML, b"<a/>" * 2**18, 100, "tags before the end of a building"),
    "deep.gml": (GML, b"<a>", 100_000, "nested too deeply"),
    "wide.gml": (
        GML + b"<a" + b"".join(b' x%d="1"' % k for k in range(10**5)) + b"/>",
        b"",
        0,
        "invalid XML",
    ),
    "lists.json.gz": (JSON, b"[]," * 2**18, 100, "too large for memory"),
    "rings.jsonl.gz": (SEQUENCE + JSON, b"[[0,1,2]]," * 2**18, 30, "too large for memory"),
    "word.json.gz": (b'{"type": "', b"x" * 2**20, 200, "decompresses to more than"),
    "deep.json": (JSON, b"[", 500_000, "lists nested too deeply"),
}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows tells no peak of memory this way")
@pytest.mark.parametrize("name", mark_cases(BOMBS, kept=2))
def test_bombs_are_refused_with_bounded_memory(tmp_path, name):
    head, piece, count, said = BOMBS[name]
    # packed parts in a row are one packed file
    pack = gzip.compress if name.endswith(".gz") else bytes
    (tmp_path / name).write_bytes(pack(head) + count * pack(piece))
    if said.startswith("decompresses"):
        assert LARGEST_GAIN * (tmp_path / name).stat().st_size < count * len(piece)
    problem, grown = memory_of_refusal(tmp_path / name)
    assert said in problem
    assert grown < (1 if "json" in name else 1.2) * 2**30


@pytest.mark.slow
def test_many_instances_of_a_template_are_refused(tmp_path, monkeypatch):
    """Small files of many copies; as many as are allowed are read."""
    placed = {"a": house(*[instance()] * 10)}
    (tmp_path / "city.json").write_text(json.dumps(model(placed, **TEMPLATES)), encoding="utf-8")
    count = 10 * len(TEMPLATES["geometry-templates"]["templates"][0]["boundaries"])
    monkeypatch.setattr(collect_shapes, "MOST_PLACED", count)
    assert len(read_city(tmp_path / "city.json")) == len(FACES)  # all stand in one place
    monkeypatch.setattr(collect_shapes, "MOST_PLACED", count - 1)
    with pytest.raises(InputError, match="template instances have more than"):
        read_city(tmp_path / "city.json")


def test_a_long_row_of_other_objects_is_no_bomb(tmp_path, monkeypatch):
    monkeypatch.setattr(parse_xml, "MOST_TAGS", 20_000)
    other = "<cityObjectMember><veg/><veg/><veg/></cityObjectMember>" * 2**13
    (tmp_path / "city.gml").write_text(
        f"{text.HEAD}{other}{text.building(WALL)}</CityModel>", encoding="utf-8"
    )
    assert len(read_city(tmp_path / "city.gml")) == 1
