"""What files tell of buildings beside shapes: attributes, addresses, names, functions, years."""

import gzip
import json
import re
import shutil
import sqlite3
import struct
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import citygml_text as text
import cityjson_text as cityjson
import pandas as pd
import pytest
import shapely
from cities import box, make_city
from footprint_text import feature, square, write_map
from small_city import FAST

from citypv.core.city.building_facts import FACTS, tell_facts, without_names
from citypv.core.city.edit_city import CityChange, edit_city
from citypv.core.commands.command_line import main
from citypv.core.light.rays_file import decode, encode, read_rays
from citypv.core.read.read_city import read_city
from citypv.core.read.read_citygml import read_citygml
from citypv.core.results import write_cityjson
from citypv.core.results.exports import RunResults
from citypv.core.results.read_results import read_results
from citypv.core.results.transfer_file import read_transfer
from citypv.core.results.write_geopackage import TABLES, write_system

DEMO = Path(__file__).parents[2] / "examples/berlin/berlin_3910_5817.gml"
DATA = Path(__file__).parents[1] / "data"
XAL_2 = """<bldg:address><Address><xalAddress><xAL:AddressDetails xmlns:xAL="urn:xal2"><xAL:Country>
<xAL:CountryName>Germany</xAL:CountryName><xAL:Locality Type="Town"><xAL:LocalityName>Halle
</xAL:LocalityName><xAL:Thoroughfare Type="Street"><xAL:ThoroughfareNumber>12
<xAL:ThoroughfareNumberSuffix>a</xAL:ThoroughfareNumberSuffix></xAL:ThoroughfareNumber>
<xAL:ThoroughfareName>Große  Straße</xAL:ThoroughfareName></xAL:Thoroughfare><xAL:PostalCode>
<xAL:PostalCodeNumber>06108</xAL:PostalCodeNumber></xAL:PostalCode></xAL:Locality></xAL:Country>
</xAL:AddressDetails></xalAddress></Address></bldg:address>"""
XAL_3 = """<bldg:address><Address><xalAddress><xAL:Address xmlns:xAL="urn:xal3"><xAL:Country>
<xAL:NameElement>France</xAL:NameElement></xAL:Country><xAL:Locality><xAL:NameElement>Lyon
</xAL:NameElement></xAL:Locality><xAL:Thoroughfare><xAL:NameElement>Rue de la Ré</xAL:NameElement>
<xAL:Number>7</xAL:Number></xAL:Thoroughfare><xAL:PostCode><xAL:Identifier>69001</xAL:Identifier>
</xAL:PostCode></xAL:Address></xalAddress></Address></bldg:address>"""
TOLD = """<gml:name>Old  mill</gml:name><creationDate>2014-07-09</creationDate>
<gen:stringAttribute xmlns:gen="urn:gen" name="Owner"><gen:value>town</gen:value>
</gen:stringAttribute><gen:intAttribute xmlns:gen="urn:gen" name="Code"><gen:value>007</gen:value>
</gen:intAttribute><gen:intAttribute xmlns:gen="urn:gen" name="Flats"><gen:value>7</gen:value>
</gen:intAttribute><gen:measureAttribute xmlns:gen="urn:gen" name="Floor"><gen:value uom="m2">42
</gen:value></gen:measureAttribute><gen:genericAttributeSet xmlns:gen="urn:gen" name="Heat">
<gen:doubleAttribute name="q"><gen:value>1.5</gen:value></gen:doubleAttribute>
</gen:genericAttributeSet><bldg:class>1000</bldg:class>
<bldg:function codeSpace="http://www.sig3d.org/codelists/citygml/2.0">1120</bldg:function>
<bldg:function>77</bldg:function><bldg:yearOfConstruction>1904</bldg:yearOfConstruction>
<bldg:roofType>3100</bldg:roofType><bldg:measuredHeight uom="urn:adv:uom:m">12.5
</bldg:measuredHeight><bldg:storeysAboveGround>4</bldg:storeysAboveGround>"""


def read_told(tmp_path, *inside):
    wall = text.surface(text.members(text.polygon("w", text.SQUARE)))
    (tmp_path / "city.gml").write_text(text.model(text.building(*inside, wall)), encoding="utf-8")
    return read_citygml(tmp_path / "city.gml").attributes


def test_attributes_of_citygml_in_the_form_of_cityjson(tmp_path):
    assert read_told(tmp_path, TOLD, XAL_2) == {
        (0, 0): {
            "attributes": {
                "name": "Old mill",
                "creationDate": "2014-07-09",
                "Owner": "town",
                "Code": "007",
                "Flats": 7,
                "Floor": {"value": 42.0, "uom": "m2"},
                "Heat": {"q": 1.5},
                "class": "1000",
                "function": "1120; 77",
                "function_codeSpace": "http://www.sig3d.org/codelists/citygml/2.0",
                "yearOfConstruction": 1904,
                "roofType": "3100",
                "measuredHeight": 12.5,
                "storeysAboveGround": 4,
            },
            "address": [
                {
                    "Country": "Germany",
                    "Locality": "Halle",
                    "ThoroughfareNumber": "12a",
                    "ThoroughfareName": "Große Straße",
                    "Postcode": "06108",
                }
            ],
        }
    }


def test_addresses_of_citygml_3_and_of_parts(tmp_path):
    part = text.wrap(
        "<gml:name>Tower</gml:name>" + XAL_3, "bldg:consistsOfBuildingPart", "bldg:BuildingPart"
    )
    told = read_told(tmp_path, part)
    (address,) = told[0, 1]["address"]
    assert (address["ThoroughfareName"], address["ThoroughfareNumber"]) == ("Rue de la Ré", "7")
    assert (address["Locality"], address["Postcode"], address["Country"]) == (
        "Lyon",
        "69001",
        "France",
    )
    assert told[0, 1]["attributes"] == {"name": "Tower"}
    # A building that tells nothing itself has what its parts tell.
    facts = tell_facts(read_city(tmp_path / "city.gml"))
    assert (facts.address, facts.name) == (["Rue de la Ré 7, Lyon"], ["Tower"])


def test_addresses_and_functions_of_the_demo_counted_in_its_text():
    plain, content = DEMO.read_text("utf-8"), read_citygml(DEMO)
    streets = [
        address["ThoroughfareName"]
        for told in content.attributes.values()
        for address in told.get("address", ())
        if "ThoroughfareName" in address
    ]
    assert streets == re.findall(r"<xAL:ThoroughfareName>(.*?)</", plain)
    assert len(streets) == 190
    functions = [
        told["attributes"]["function"]
        for told in content.attributes.values()
        if "function" in told.get("attributes", {})
    ]
    assert functions == re.findall(r"<bldg:function>(.*?)</", plain)
    assert len(functions) == 159


def test_facts_of_buildings_are_read_from_results(small_results):
    """As the city of `small_city` tells them of house a, and nothing of the others."""
    buildings = read_results(small_results).buildings
    assert buildings[["building", *FACTS]].to_numpy().tolist() == [
        ["a", "Große Straße 12, Halle", "Old mill", "office building (1120)", "1904"],
        ["b", "", "", "", ""],
        ["c", "", "", "", ""],
    ]


def test_results_of_earlier_versions_tell_nothing_of_buildings(small_results, tmp_path):
    folder = shutil.copytree(small_results, tmp_path / "old")
    table = pd.read_csv(folder / "buildings.csv").drop(columns=[*FACTS])
    table.to_csv(folder / "buildings.csv", index=False)
    assert (read_results(folder).buildings[[*FACTS]] == "").all(axis=None)
    (folder / "buildings.csv").unlink()
    assert read_results(folder).buildings["building"].tolist() == ["a", "b", "c"]


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Write the city of a file as CityJSON, without light and results: its city objects."""
    monkeypatch.setattr(write_cityjson, "_describe_surfaces", lambda city, *_: [{}] * len(city))

    def sum_nothing(transfer, *_, **__):
        names = sorted(set(transfer.building_id))
        return pd.DataFrame({"building_id": names, "kwp": 0.0, "eligible_area": 0.0})

    monkeypatch.setattr(write_cityjson, "sum_buildings", sum_nothing)

    def write(path):
        city = read_city(path)
        weather = SimpleNamespace(label="none")
        run = RunResults(city, None, city, None, weather)
        write_cityjson.write_cityjson(tmp_path / "city.city.json", run)
        document = json.loads((tmp_path / "city.city.json").read_text("utf-8"))
        return document["CityObjects"]

    return write


def list_own(objects):
    """Attributes of buildings and parts without those of results, as sorted texts."""
    told = [
        {
            name: value
            for name, value in one.get("attributes", {}).items()
            if not name.startswith("citypv_")
        }
        for one in objects
        if one["type"].startswith("Building")
    ]
    return sorted(json.dumps(own, sort_keys=True) for own in told if own)


def test_attributes_of_cityjson_stay_as_they_are(tmp_path, written):
    """Values of every type, unusual names, of a building and of its part without a shape; an
    address without its place, which is in vertices of the file.
    """
    told = {"a": 1, "b": None, "c": [1, {"d": 2.5}], "e": True, "naïve": "\ud800 ½", "f": 1e300}
    address = {"Country": "NL", "location": {"type": "MultiPoint", "boundaries": [0], "lod": "1"}}
    part = {"parents": ["a"], "attributes": {"roofType": "1070"}}
    one = cityjson.house(cityjson.solid(), attributes=told, address=address, children=["p"])
    objects = {"a": one, "p": cityjson.house(kind="BuildingPart", **part)}
    source = tmp_path / "city.json"
    source.write_text(json.dumps(cityjson.model(objects)), encoding="utf-8")
    again = written(source)
    assert list_own(again.values()) == list_own(objects.values())
    assert again["a"]["address"] == [{"Country": "NL"}]
    assert "citypv_eligible_area" in again["a"]["attributes"]
    assert [one["parents"] for one in again.values() if one["type"] == "BuildingPart"] == [["a"]]


@pytest.mark.parametrize(
    "name",
    [
        "rotterdam_delfshaven_v20.city.json.gz",
        "3dbag_delft_subset_v20.city.jsonl.gz",
        "denhaag_random_5.city.jsonl",
    ],
)
def test_attributes_of_real_cityjson_are_unchanged(name, written):
    path = DATA / "cityjson" / name
    data = path.read_bytes()
    texts = (gzip.decompress(data) if name.endswith("gz") else data).decode().splitlines()
    objects = [one for text in texts for one in json.loads(text).get("CityObjects", {}).values()]
    told = list_own(objects)
    assert list_own(written(path).values()) == told and len(told) >= 10


def test_attributes_of_the_demo_are_written(written):
    """Counted in the text of the file."""
    plain, objects = DEMO.read_text("utf-8"), written(DEMO).values()
    assert sum(len(one.get("address", ())) for one in objects) == plain.count("<Address>")
    for name in ("function", "roofType", "measuredHeight"):
        told = [one["attributes"][name] for one in objects if name in one.get("attributes", {})]
        assert len(told) == plain.count(f"<bldg:{name}>") > 100
        assert sorted(map(str, told)) == sorted(re.findall(f"<bldg:{name}>(.*?)</", plain))


def test_attributes_of_outlines_are_unchanged(written):
    path = DATA / "footprints/geoclimate_building_part.geojson.gz"
    features = json.loads(gzip.decompress(path.read_bytes()))["features"]
    told = sorted(json.dumps(one["properties"], sort_keys=True) for one in features)
    own = list_own(written(path).values())
    assert set(own) <= set(told)
    assert len(own) == len({one["properties"]["ID_SOURCE"] for one in features}) - 1


def test_what_outlines_and_their_parts_tell(tmp_path):
    """A building that is drawn by its part keeps the address of its outline; tags in a column are
    told one by one.
    """
    house = {"addr:street": "Kirchgasse", "addr:housenumber": "3", "addr:city": "Köln"}
    church = {"tags": {"name": "St. Maria", "start_date": "C12, 1904"}, "building": "church"}
    path = write_map(
        tmp_path / "town.geojson",
        feature(square(0, 0), "way/1", building="house", height=9, **house),
        feature(square(0, 0, 10, 5), "way/2", **{"building:part": "yes", "height": 7}),
        feature(square(40, 0), "way/3", height=20, **church),
    )
    city = read_city(path)
    assert city.attributes["way/1", ""]["attributes"]["addr:street"] == "Kirchgasse"
    assert "tags" not in city.attributes["way/3", ""]["attributes"]
    facts = tell_facts(city)
    assert facts.of(["way/1", "way/3"]) == {
        "address": ["Kirchgasse 3, Köln", ""],
        "name": ["", "St. Maria"],
        "function": ["house", "church"],
        "year": ["", "1904"],
    }


def test_a_geopackage_keeps_all_columns(tmp_path):
    """Of which heights need no more than one; blobs are left out."""
    path = tmp_path / "town.gpkg"
    with closing(sqlite3.connect(path)) as file, file:
        file.executescript(TABLES)
        number = write_system(file, "EPSG:25832")
        file.execute("CREATE TABLE houses (geom, height, strasse, hausnr, gfk, photo, note)")
        file.execute(
            "INSERT INTO gpkg_geometry_columns VALUES ('houses', 'geom', 'POLYGON', ?, 0, 0)",
            (number,),
        )
        shape = struct.pack("<2sBBi", b"GP", 0, 1, number)
        shape += shapely.box(5e5, 5.6e6, 5e5 + 10, 5.6e6 + 10).wkb
        row = (shape, 9.5, "Gässle", 4, "31001_1010", b"\x00", None)
        file.execute("INSERT INTO houses VALUES (?, ?, ?, ?, ?, ?, ?)", row)
    city = read_city(path)
    (told,) = city.attributes.values()
    assert told["attributes"] == {
        "height": 9.5,
        "strasse": "Gässle",
        "hausnr": 4,
        "gfk": "31001_1010",
    }
    facts = tell_facts(city)
    assert (facts.address, facts.function) == (["Gässle 4"], ["Wohnhaus (31001_1010)"])


@pytest.mark.parametrize(
    ("attributes", "function", "year"),
    [
        ({"function": "31001_2463"}, "Garage (31001_2463)", ""),
        # the same digits mean something else in each list
        ({"function": "1220"}, "1220", ""),
        (
            {"function": "1220", "function_codeSpace": "http://www.sig3d.org/codelists/citygml"},
            "youth hostel (1220)",
            "",
        ),
        (
            {"gebaeudefunktion": 1220},
            "Land- und forstwirtschaftliches Wohn- und Betriebsgebäude (1220)",
            "",
        ),
        ({"function": "31001_7777"}, "31001_7777", ""),
        (
            {"currentUse": "http://inspire.ec.europa.eu/codelist/CurrentUseValue/residential"},
            "residential",
            "",
        ),
        ({"building": "yes", "amenity": "school", "start_date": "1904-05-01"}, "school", "1904"),
        ({"oorspronkelijkbouwjaar": 1870}, "", "1870"),
        ({"dateOfConstruction": "1929-01-01", "yearOfConstruction": 0}, "", "1929"),
        ({"usage": "422", "usage_codeSpace": "../../codelists/Building_usage.xml"}, "422", ""),
    ],
)
def test_functions_and_years_in_words(attributes, function, year):
    city = make_city(box("a", 0, 0, 5, 5, 0, 5))
    city.attributes = {(city.building_id[0], ""): {"attributes": attributes}}
    facts = tell_facts(city)
    assert (facts.function, facts.year) == ([function], [year])


@pytest.mark.slow
def test_private_results_tell_neither_names_nor_addresses(small_results, tmp_path):
    """Not in any file, with all else; no more does a report or electricity of a run that told
    them.
    """
    secrets = [b"Halle", b"Stra\xc3\x9fe", b"Old mill"]
    source, options = small_results.parent / "city.gml", ("--overwrite", "--quiet", "--private")
    exports = ["--cityjson", "--gltf", "--geopackage", "--editable"]
    out, again = tmp_path / "out", tmp_path / "again"
    assert main(["simulate", str(source), "--out", str(out), *exports, *FAST, "--private"]) == 0
    assert main(["yield", str(small_results), "--out", str(again), *options]) == 0
    assert main(["plot", str(again), "--quiet"]) == 0
    files = [path for folder in (out, again) for path in folder.rglob("*") if path.is_file()]
    assert len(files) > 14
    told = {(path.name, word) for path in files for word in secrets if word in path.read_bytes()}
    assert told == set()
    for folder in (out, again):
        assert read_results(folder).buildings["function"][0] == "office building (1120)"
        stored = read_transfer(folder / "transfer.nc").facts
        assert (stored.address, stored.name, stored.year) == ([""], [""], ["1904"])
    assert {*read_rays(out).city.attributes["a", ""]["attributes"]} == {
        *("function", "function_codeSpace", "yearOfConstruction")
    }
    # The same words are found where nobody asked to leave them out.
    assert b"Old mill" in (small_results / "city.city.json").read_bytes()
    assert read_transfer(small_results / "transfer.nc").facts.name == ["Old mill"]


def told_boxes(*names):
    """Boxes in a row, each with attributes that say its name."""
    city = make_city(
        [one for k, name in enumerate(names) for one in box(name, 9 * k, 0, 5, 5, 0, 5)]
    )
    city.attributes = {(name, ""): {"attributes": {"name": f"House {name}"}} for name in names}
    return city


def test_buildings_that_stay_keep_what_was_told_in_edits():
    """One that is removed takes it along, also where a new one gets its id; one that is added
    brings its own under the id that it gets.
    """
    city, more = told_boxes("a", "b", "c"), told_boxes("a", "d")
    more.attributes["a", ""] = {"attributes": {"name": "New"}}
    change = CityChange(removed=["a", "b"], moved={"c": (1.0, 0.0)}, added=(more, told_boxes("c")))
    edited = edit_city(city, change)
    names = {place[0]: told["attributes"]["name"] for place, told in edited.attributes.items()}
    assert names == {"c": "House c", "a": "New", "d": "House d", "c~2": "House c"}
    assert set(names) == set(edited.building_id)


def test_what_was_told_comes_back_from_the_files_of_rays():
    city, arrays = told_boxes("a"), []
    city.attributes["a", "1"] = {"address": [{"Locality": "Halle"}], "attributes": {"x": [1, None]}}
    kept = json.loads(json.dumps(encode(city, arrays)))
    again = decode(kept, {f"array_{k}": array for k, array in enumerate(arrays)})
    assert again.attributes == city.attributes


def test_names_and_addresses_alone_are_private():
    city = told_boxes("a")
    stays = {"function": "31001_1010", "roofType": "1000", "DachtypName": "flat", "addrless": 1}
    told = {
        **stays,
        **{"name": "x", "name:de": "x", "alt_name": "x", "addr:street": "x", "addr:unit": "x"},
        **{"Straße": "x", "hausnr": 4, "plz": "06108", "contact:city": "x", "names": {"de": "x"}},
    }
    city.attributes = {("a", ""): {"attributes": told, "address": [{"Locality": "Halle"}]}}
    assert without_names(city).attributes == {("a", ""): {"attributes": stays}}
    city.attributes = {("a", ""): {"address": [{"Locality": "Halle"}]}}
    assert without_names(city).attributes == {}


def test_an_id_is_no_name():
    city = told_boxes("GUID_7F91F413-F839-48F6", "b_12", "Mill")
    for (building, _), name in zip(
        city.attributes, ("{7F91F413-F839-48F6}", "12", "mill"), strict=True
    ):
        city.attributes[building, ""] = {"attributes": {"name": name, "yearBuilt": 1900}}
    assert tell_facts(city).name == ["", "12", ""]


def test_attributes_of_citygml_3_and_units_of_heights(tmp_path):
    """Generic attributes name themselves inside; a height has its value inside; a unit that is not
    the metre is told beside its number.
    """
    generic = """<genericAttribute><gen:IntAttribute xmlns:gen="g"><gen:name>Flats</gen:name>
<gen:value>7</gen:value></gen:IntAttribute></genericAttribute><genericAttribute>
<gen:GenericAttributeSet xmlns:gen="g"><gen:name>Heat</gen:name><gen:genericAttribute>
<gen:MeasureAttribute><gen:name>q</gen:name><gen:value uom="kW">1.5</gen:value>
</gen:MeasureAttribute></gen:genericAttribute></gen:GenericAttributeSet></genericAttribute>"""
    height = """<con:height xmlns:con="c"><con:Height><con:status>measured</con:status>
<con:value uom="m">9.5</con:value></con:Height></con:height>"""
    (told,) = read_told(tmp_path, generic, height).values()
    heat = {"q": {"value": 1.5, "uom": "kW"}}
    assert told["attributes"] == {"Flats": 7, "Heat": heat, "measuredHeight": 9.5}
    for unit, more in (("#m", {}), ("cm", {"measuredHeight_uom": "cm"})):
        plain = f'<bldg:measuredHeight uom="{unit}">950</bldg:measuredHeight>'
        (told,) = read_told(tmp_path, plain).values()
        assert told["attributes"] == {"measuredHeight": 950.0} | more


def test_inspect_counts_what_is_told(city, capsys):
    assert main(["inspect", str(city)]) == 0
    assert (
        "facts        address of 1, name of 1, function of 1, year of 1\n"
        in capsys.readouterr().out
    )
