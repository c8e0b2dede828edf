"""Small files that unpack to large ones are refused with bounded memory, and what only looks like one is read."""

import gzip
import sys

import citygml_text as text
import pytest
from memory_of_reading import memory_of_refusal

from citypv.core.read.read_city import read_city

pytestmark = pytest.mark.once


BOMBS = {
    "comments.gml.gz": (text.HEAD.encode(), b"<!--" + b" " * 2**20 + b"-->", 300),
    "lines.obj.gz": (b"v 0 0 0\n", b"#" + b" " * 1022 + b"\n", 300_000),
    "elements.gml.gz": (text.HEAD.encode(), b"<a/>" * 2**18, 100),
    "inside.gml.gz": (text.HEAD.encode() + b"<cityObjectMember>", b"<a></a>" * 2**17, 100),
    "deep.gml": (text.HEAD.encode(), b"<a>", 100_000),
    "wide.gml": (text.HEAD.encode() + b"<a", b"", 0),
}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows tells no peak of memory this way")
@pytest.mark.parametrize("name", BOMBS)
def test_bombs_are_refused_with_bounded_memory(tmp_path, name):
    head, piece, count = BOMBS[name]
    if name == "wide.gml":
        head += b"".join(b' x%d="1"' % k for k in range(10**5)) + b"/>"
    with (gzip.open if name.endswith(".gz") else open)(tmp_path / name, "wb") as packed:
        packed.write(head)
        for _ in range(count):
            packed.write(piece)
    problem, grown = memory_of_refusal(tmp_path / name)
    assert problem
    assert grown < 1.2 * 2**30


def test_a_long_row_of_other_objects_is_no_bomb(tmp_path):
    other = b"<cityObjectMember><veg/><veg/><veg/></cityObjectMember>" * 2**12
    house = text.building(text.surface(text.members(text.polygon("a", text.SQUARE))))
    with (tmp_path / "city.gml").open("wb") as stream:
        stream.write(text.HEAD.encode())
        for _ in range(220):
            stream.write(other)
        stream.write(house.encode() + b"</CityModel>")
    assert len(read_city(tmp_path / "city.gml")) == 1
