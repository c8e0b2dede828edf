"""What files tell of buildings beside shapes: attributes, addresses, names, functions, years."""

import re
import shutil
from pathlib import Path

import citygml_text as text
import pandas as pd

from citypv.core.city.building_facts import tell_facts
from citypv.core.read.read_city import read_city
from citypv.core.read.read_citygml import read_citygml
from citypv.core.results.read_results import read_results

DEMO = Path(__file__).parents[2] / "examples/berlin/berlin_3910_5817.gml"
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
    assert [*buildings.columns] == ["building", "address", "name", "function", "year"]
    assert buildings.to_numpy().tolist() == [
        ["a", "Große Straße 12, Halle", "Old mill", "office building (1120)", "1904"],
        ["b", "", "", "", ""],
        ["c", "", "", "", ""],
    ]


def test_results_of_earlier_versions_tell_nothing_of_buildings(small_results, tmp_path):
    folder = shutil.copytree(small_results, tmp_path / "old")
    table = pd.read_csv(folder / "buildings.csv").drop(
        columns=["address", "name", "function", "year"]
    )
    table.to_csv(folder / "buildings.csv", index=False)
    assert (read_results(folder).buildings.to_numpy()[:, 1:] == "").all()
    (folder / "buildings.csv").unlink()
    assert read_results(folder).buildings["building"].tolist() == ["a", "b", "c"]
