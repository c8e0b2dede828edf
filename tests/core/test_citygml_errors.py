"""Files that cannot be used end in one clear line: file, place, cure."""

import copyreg
import gzip
import pickle

import citygml_text as text
import pytest

from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

HOUSE = text.building(text.surface(text.members(text.polygon("a", text.SQUARE))))
GOOD = text.model(HOUSE).encode()
LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "ha">'
    + "".join(f'<!ENTITY {chr(98 + k)} "{f"&{chr(97 + k)};" * 10}">' for k in range(9))
    + ']><CityModel xmlns="http://www.opengis.net/citygml/2.0">&j;</CityModel>'
)
OUTSIDE = '<!DOCTYPE x SYSTEM "http://localhost:1/x.dtd"><CityModel xmlns="http://www.opengis.net/citygml/2.0"/>'
FILES = {
    "empty": (b"", "empty"),
    "cut": (GOOD[: len(GOOD) // 2], r"line \d+: invalid XML"),
    "cut in the head": (GOOD[:60], r"line \d+: "),
    "no xml": (b"hello", "line 1"),
    "binary": (bytes(range(1, 200)), "line 1"),
    "html": (b"<html><body>404</body></html>", r"line 1: <html> is not CityGML"),
    "no buildings": (text.model().encode(), "no buildings"),
    "building without a shape": (text.model(text.building()).encode(), "no building has a usable shape"),
    "laughs": (LAUGHS.encode(), "line 1: document types"),
    "external document type": (OUTSIDE.encode(), "line 1: document types"),
    "entity of an attribute": (
        GOOD.replace(b"<CityModel", b'<!DOCTYPE m [<!ENTITY e "x">]><CityModel').replace(b"house", b"&e;"),
        "document type",
    ),
    "zip": (b"PK\x03\x04....", "zip archive"),
    "long namespace": (GOOD.replace(b"<CityModel ", b'<CityModel xmlns:p="' + b"a b " * 200 + b'" ', 1), "invalid XML"),
    "cut gzip": (gzip.compress(GOOD)[:-40], "decompression fails"),
    "long attribute": (GOOD.replace(b'"house"', b'"' + b"x" * 11_000_000 + b'"'), r"line \d+: too much text or nested"),
}


def assert_refused(path, problem, longest=500):
    """One short line: file, place and cure."""
    with pytest.raises(InputError, match=problem) as caught:
        read_city(path)
    message = str(caught.value)
    assert message.startswith(str(path)) and "; " in message and "\n" not in message and len(message) < longest


@pytest.mark.parametrize("name", FILES)
def test_refused_with_file_place_and_cure(tmp_path, name):
    data, problem = FILES[name]
    path = tmp_path / "city.gml"
    path.write_bytes(data)
    assert_refused(path, problem)


def test_missing_file_and_folder_without_files_of_buildings(tmp_path):
    with pytest.raises(InputError, match=r"nowhere.gml: no such file; check the path"):
        read_city(tmp_path / "nowhere.gml")
    with pytest.raises(InputError, match="folder without building files"):
        read_city(tmp_path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "iso-8859-1"])
def test_encodings_and_byte_order_marks(tmp_path, encoding):
    written = GOOD.decode().replace("UTF-8", {"utf-8-sig": "UTF-8"}.get(encoding, encoding.upper()))
    (tmp_path / "city.gml").write_bytes(written.encode(encoding))
    assert read_city(tmp_path / "city.gml").surface_id == ["a"]


def test_one_huge_line(tmp_path):
    many = "".join(HOUSE.replace('"house"', f'"h{k}"').replace('"a"', f'"a{k}"').strip() for k in range(3000))
    (tmp_path / "city.gml").write_text(text.HEAD.replace("\n", "") + many + "</CityModel>", encoding="utf-8")
    assert len(read_city(tmp_path / "city.gml")) == 3000


@pytest.mark.parametrize("comment", ["", "<!-- <CityModel> -->"])
def test_undeclared_prefixes_are_declared_and_noted(tmp_path, comment):
    written = GOOD.decode().replace("<gml:surfaceMember>", '<gml:surfaceMember xlink:show="new"><uro:x/><bad:y/>')
    written = written.replace(' xmlns:xlink="http://www.w3.org/1999/xlink"', "").replace(
        "<CityModel", f"{comment}<CityModel"
    )
    (tmp_path / "city.gml").write_text(written, encoding="utf-8")
    city = read_city(tmp_path / "city.gml")
    assert city.surface_id == ["a"]
    assert [note.split("prefix ")[1].split()[0] for note in city.report.notes] == ["'xlink'", "'uro'", "'bad'"]


def test_undeclared_prefix_of_the_building_itself(tmp_path):
    written = GOOD.decode().replace(' xmlns:bldg="http://www.opengis.net/citygml/building/2.0"', "")
    (tmp_path / "city.gml").write_text(written, encoding="utf-8")
    assert read_city(tmp_path / "city.gml").thematic == ["WallSurface"]


def test_undeclared_prefix_that_cannot_be_mended_is_named(tmp_path, monkeypatch):
    written = GOOD.decode().replace("<gml:surfaceMember>", "<gml:surfaceMember><uro:x/>").replace("UTF-8", "UTF-16")
    (tmp_path / "city.gml").write_bytes(written.encode("utf-16"))
    with pytest.raises(InputError, match=r"line 3: the prefix 'uro' is not declared; declare it") as caught:
        read_city(tmp_path / "city.gml")
    monkeypatch.delitem(copyreg.dispatch_table, type(caught.value), raising=False)  # Dask's, if tests of it ran before
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
    many = "".join(f"<p{k}:x/>" for k in range(17))
    (tmp_path / "many.gml").write_text(GOOD.decode().replace("<gml:surfaceMember>", "<gml:surfaceMember>" + many))
    with pytest.raises(InputError, match="the prefix 'p16'"):
        read_city(tmp_path / "many.gml")
