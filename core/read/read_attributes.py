"""Attributes and addresses of buildings and parts, in the form of CityJSON: of CityGML 1, 2 and 3,
of CityJSON itself, and of rows of outlines.

An attribute that holds a text has the name of its element, without its prefix; a number stands as a
number where the standard says that it is one. Generic attributes have the names that the file gives
them. Addresses in xAL 2 and 3 become a list of objects.
"""

import math
import re
import sys
from functools import lru_cache

# what the standards count or measure; others are texts
WHOLE = ("yearOfConstruction", "yearOfDemolition", "storeysAboveGround", "storeysBelowGround")
# elements that hold neither an attribute nor anything in which to look for one
OTHERS = ("boundedBy", "boundary", "interiorRoom", "consistsOfBuildingPart", "buildingPart")
# elements of xAL -> members of an address in CityJSON; of xAL 3 behind the element that holds them
ADDRESS = {
    "CountryName": "Country",
    "LocalityName": "Locality",
    "DependentLocalityName": "DependentLocality",
    "AdministrativeAreaName": "AdministrativeArea",
    "ThoroughfareName": "ThoroughfareName",
    "ThoroughfareNumber": "ThoroughfareNumber",
    "ThoroughfareNumberFrom": "ThoroughfareNumber",
    "ThoroughfareNumberTo": "ThoroughfareNumberTo",
    "ThoroughfareNumberSuffix": "ThoroughfareNumberSuffix",
    "PremiseName": "PremiseName",
    "BuildingName": "PremiseName",
    "PremiseNumber": "PremiseNumber",
    "PostalCodeNumber": "Postcode",
    "AddressLine": "AddressLine",
    "Country/NameElement": "Country",
    "Locality/NameElement": "Locality",
    "SubLocality/NameElement": "DependentLocality",
    "AdministrativeArea/NameElement": "AdministrativeArea",
    "Thoroughfare/NameElement": "ThoroughfareName",
    "Thoroughfare/Number": "ThoroughfareNumber",
    "Premises/NameElement": "PremiseName",
    "Premises/Number": "PremiseNumber",
    "PostCode/Identifier": "Postcode",
}
IN_ADDRESS = ("NameElement", "Number", "Identifier")  # elements of xAL 3 that say no more alone


def read_attributes(element):
    """What an element of CityGML, a building or a part of one, tells of itself: dict with
    `attributes` and `address`, without those that it does not tell.
    """
    attributes, addresses = {}, []
    for child in element:
        name = _local(child.tag)
        if name in OTHERS or name.startswith("lod"):
            continue
        if name.endswith(("Attribute", "AttributeSet")):
            _add_generic(child, name, attributes)
        elif name == "address":
            addresses += map(_read_address, child.iterchildren("{*}Address"))
        elif name == "height":
            # CityGML 3 says what was measured, and between what: the first is taken.
            value = child.findtext("{*}Height/{*}value")
            attributes.setdefault("measuredHeight", _take_number(value, float))
        elif len(child) == 0:
            _add_plain(child, name, attributes)
    attributes = {name: value for name, value in attributes.items() if value is not None}
    addresses = [address for address in addresses if address]
    told = {"attributes": attributes} if attributes else {}
    return told | ({"address": addresses} if addresses else {})


def take_attributes(one):
    """What a city object of CityJSON tells of itself, unchanged: as of `read_attributes`.

    An address is a list also where older files have a single one; the place of one, in vertices of
    the file, is left out.
    """
    attributes, addresses = one.get("attributes"), one.get("address")
    told = {}
    if isinstance(attributes, dict) and attributes:
        # Lines of CityJSONSeq spell the same names again and again: each is kept once.
        told["attributes"] = {sys.intern(name): value for name, value in attributes.items()}
    addresses = addresses if isinstance(addresses, list) else [addresses]
    addresses = [
        {name: value for name, value in address.items() if name != "location"}
        for address in addresses
        if isinstance(address, dict)
    ]
    return told | ({"address": addresses} if any(addresses) else {})


def list_tags(value):
    """Keys and texts of tags that a column holds together, an object or GDAL's text of
    `"key"=>"value"`: list of tuples.
    """
    if isinstance(value, dict):
        return list(value.items())
    pair = r'"((?:[^"\\]|\\.)*)"\s*=>\s*"((?:[^"\\]|\\.)*)"'
    return re.findall(pair, value) if isinstance(value, str) else []


def _add_plain(element, name, attributes):
    """Add the text of an element, with its codeSpace; several of one name stand in one text."""
    text = _text(element)
    if not text:
        return
    if name in WHOLE:
        attributes[name] = _take_number(text, int)
    elif name.startswith("storeyHeights"):
        attributes[name] = [_take_number(word, float) for word in text.split()]
    elif name == "measuredHeight":
        attributes[name] = _take_number(text, float)
        unit = element.get("uom", "")
        if unit and re.split("[:#/]", unit.lower())[-1] not in ("m", "metre", "meter"):
            attributes[f"{name}_uom"] = unit
    else:
        attributes[name] = f"{attributes[name]}; {text}" if name in attributes else text
        if element.get("codeSpace"):
            attributes[f"{name}_codeSpace"] = element.get("codeSpace")


@lru_cache(maxsize=1024)
def _local(tag):
    """Name of an element without its namespace; "" of what is no element."""
    return tag.rpartition("}")[2] if isinstance(tag, str) else ""


def _add_generic(element, name, attributes):
    """Add a generic attribute, or a set of such, under the name that the file gives it."""
    key, value = element.get("name"), None
    # numbers, by the beginning of the element's name
    kind = {"int": int, "dou": float, "mea": float}.get(name[:3].lower(), str)
    for child in element:
        own = _local(child.tag)
        # CityGML 3: a genericAttribute holds an IntAttribute with the elements name and value.
        if name == "genericAttribute":
            _add_generic(child, own, attributes)
        elif own == "value":
            value, unit = _take_number(_text(child), kind), child.get("uom")
            value = {"value": value, "uom": unit} if unit and value is not None else value
        elif own == "name":
            key = key or _text(child)
        elif own.endswith(("Attribute", "AttributeSet")):
            value = value or {}
            _add_generic(child, own, value)
    if key and value not in (None, {}, ""):
        # A name that is taken gets a number.
        number, free = 1, key
        while free in attributes:
            number += 1
            free = f"{key}~{number}"
        attributes[free] = value


def _read_address(element):
    """An address in xAL: dict of members of CityJSON to texts; several of one kind in one text."""
    address = {}
    for child in element.iterdescendants():
        name = _local(child.tag)
        member = ADDRESS.get(name)
        if member is None and name in IN_ADDRESS:
            member = ADDRESS.get(f"{_local(child.getparent().tag)}/{name}")
        text = _text(child) if member else ""
        if text:
            address[member] = f"{address[member]} {text}" if member in address else text
    # A letter behind a number belongs to it, and so does the end of a range.
    suffix = address.pop("ThoroughfareNumberSuffix", "")
    last = address.pop("ThoroughfareNumberTo", "")
    if "ThoroughfareNumber" in address:
        address["ThoroughfareNumber"] += suffix + (f"-{last}" if last else "")
    return address


def _text(element):
    return " ".join((element.text or "").split())


def _take_number(text, kind):
    """A text as a number; as it is where it is none."""
    if kind is str or not text:
        return text or None
    try:
        number = kind(text)
    except ValueError:
        return text
    # A code of digits that begins with zero is no number.
    return number if math.isfinite(number) and (kind is float or str(number) == text) else text
