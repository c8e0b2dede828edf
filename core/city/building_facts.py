"""What files tell of a building, in words: its address, its name, what it is for, and when it was
built.

Attributes have the form of CityJSON, whatever the format of their file (`City.attributes`). What
producers call them stands in tables; names are compared without regard to case and signs.
"""

import re
from collections import defaultdict
from dataclasses import dataclass, field, replace
from functools import lru_cache

from ..settings.errors import show_signs
from .function_codes import word_of_function

FACTS = ("address", "name", "function", "year")  # of BuildingFacts

# Names of attributes, the first that has a value counts: members of an `address`, or attributes of
# outlines and of registers.
STREET = (
    *("thoroughfarename", "addrstreet", "street", "streetname", "strasse", "straße"),
    *("strassenname", "straßenname", "strname", "straatnaam", "openbareruimtenaam", "rue", "via"),
    *("calle", "ulica", "addrplace"),
)
NUMBER = (
    *("thoroughfarenumber", "addrhousenumber", "housenumber", "streetnumber", "hausnummer"),
    *("hausnr", "hnr", "huisnummer", "civico", "numero"),
)
TOWN = (
    *("locality", "localityname", "addrcity", "city", "town", "municipality", "gemeinde"),
    *("gemeindename", "ort", "ortsname", "stadt", "woonplaats", "woonplaatsnaam", "gemeente"),
    *("commune", "nomcommune", "comune"),
)
WHOLE = (
    *("addressline", "addrfull", "address", "fulladdress", "adresse", "adres", "direccion"),
    *("indirizzo", "lagebeztxt"),
)
# what else an address has, which is not told but private
REST = (
    *("addrhousename", "addrpostcode", "addrsuburb", "addrunit", "addrflats", "addrdoor"),
    *("addrdistrict", "addrcountry", "addrstate", "addrprovince", "addrinterpolation"),
    *("postcode", "postalcode", "postleitzahl", "plz", "zip", "zipcode"),
)
NAME = (
    *("name", "names", "buildingname", "gebaeudename", "gebäudename", "gebnam", "gebnutzbez"),
    *("addrhousename", "naam", "nom", "nome", "nombre"),
)
OTHER_NAMES = ("altname", "officialname", "oldname", "shortname", "locname", "intname", "natname")
FUNCTION = (
    *("function", "bezgfk", "gebaeudefunktion", "gebäudefunktion", "funktion", "gfk"),
    *("gebaeudefu", "currentuse", "usage", "building", "subtype", "buildingtype", "mainuse"),
    *("usage1", "gebruiksdoel", "type", "amenity", "shop", "tourism", "office", "leisure"),
)
YEAR = (
    *("yearofconstruction", "dateofconstruction", "oorspronkelijkbouwjaar", "bouwjaar"),
    *("baujahr", "yearbuilt", "builtyear", "constructionyear", "cnstrctyr", "startdate"),
    *("anneedeconstruction", "annee", "dateapp", "age"),
)
# attributes by which Germany's surveying authorities name their list of codes
OF_ADV = ("gebaeudefunktion", "gebäudefunktion", "funktion", "gfk", "gebaeudefu")


@dataclass
class BuildingFacts:
    """What is told of b buildings, in words; "" where nothing is."""

    building: list = field(default_factory=list)  # (b,) str, ids
    address: list = field(default_factory=list)  # (b,) str: street, number, town
    name: list = field(default_factory=list)  # (b,) str
    function: list = field(default_factory=list)  # (b,) str: word and code, or what is told of both
    year: list = field(default_factory=list)  # (b,) str, of construction, in digits

    def of(self, buildings):
        """Facts of some buildings, list of str, by their name: dict of lists of str."""
        row = {name: k for k, name in enumerate(self.building)}
        rows = [row.get(name) for name in buildings]
        return {name: ["" if k is None else getattr(self, name)[k] for k in rows] for name in FACTS}

    def without_names(self):
        """Facts without addresses and names: BuildingFacts."""
        empty = [""] * len(self.building)
        return replace(self, address=empty, name=empty)


def tell_facts(city):
    """What the files tell of the buildings of a City: BuildingFacts, without buildings that they
    tell nothing about; None where there are no others.
    """
    told, facts = defaultdict(list), BuildingFacts()
    for (building, part), own in city.attributes.items():
        known = _plain_names(own.get("attributes", {}))
        told[building].append((part != "", (known, [*map(_plain_names, own.get("address", ()))])))
    for building in dict.fromkeys(city.building_id):
        # What stands for the building itself comes before what stands for its parts.
        levels = [[own for of_part, own in told[building] if of_part == level] for level in (0, 1)]
        words = [
            next(filter(None, (tell(own) for own in levels if own)), "")
            for tell in (_tell_address, _tell_name, _tell_function, _tell_year)
        ]
        words[1] = "" if _is_id(words[1], building) else words[1]
        if any(words):
            for name, word in zip(("building", *FACTS), (building, *words), strict=True):
                getattr(facts, name).append(word)
    return facts if facts.building else None


def without_names(city):
    """The City without the addresses and names of its buildings; all else that its files tell
    stays.
    """
    private = {*STREET, *NUMBER, *TOWN, *WHOLE, *REST, *NAME, *OTHER_NAMES}

    def is_private(key):
        return _plain(key) in private or key.startswith(("addr:", "name:", "contact:"))

    attributes = {}
    for place, told in city.attributes.items():
        own = {key: one for key, one in told.get("attributes", {}).items() if not is_private(key)}
        if own:
            attributes[place] = {"attributes": own}
    return replace(city, attributes=attributes)


@lru_cache(maxsize=4096)
def _plain(name):
    """A name of an attribute without case and signs."""
    return re.sub(r"[\W_]", "", name.lower())


def _plain_names(values):
    """Values by their names without case and signs, the first of each name: dict."""
    known = {}
    for key, value in values.items():
        known.setdefault(_plain(key), value)
    return known


def _find(known, names):
    """Text of the first of some names that has one among values of `_plain_names`; "" without
    any.
    """
    return next(filter(None, (_text(known[name]) for name in names if name in known)), "")


def _text(value):
    """A value of a file as a text of one line, "" for none; of several the first."""
    if isinstance(value, dict):
        value = value.get("primary", value.get("value"))
    if isinstance(value, list):
        value = next(iter(value), None)
    if value is None or isinstance(value, bool | dict | list):
        return ""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    text = show_signs(" ".join(str(value).split()))
    return "" if text.lower() in ("null", "none", "nan", "*") else text


def _tell_address(told):
    """Addresses of a building, or of its parts: each street with number and town, once."""
    places = [place for _, own in told for place in own] + [known for known, _ in told]
    return "; ".join(dict.fromkeys(filter(None, map(_join_address, places))))


def _join_address(place):
    street, number, town, whole = (_find(place, names) for names in (STREET, NUMBER, TOWN, WHOLE))
    # A town alone is no address.
    line = " ".join(filter(None, (street, number))) if street else whole
    return f"{line}, {town}" if line and town and town not in line else line


def _is_id(name, building, *, least=12):
    """Whether a name only says the id of its building once more, or its end of so many signs."""
    name, building = _plain(name), _plain(building)
    return name == building or (len(name) >= least and building.endswith(name))


def _tell_name(told):
    return next(filter(None, (_find(known, NAME) for known, _ in told)), "")


def _tell_function(told):
    """What a building is for: the word, and the code that stands for it; what the file has where
    nothing tells the list of its codes.
    """
    for known, _ in told:
        for name in filter(known.__contains__, FUNCTION):
            text = _text(known[name])
            # Tags that say no more than that it is a building.
            if not text or text.lower() in ("yes", "building", "building_part", "buildingpart"):
                continue
            space = "adv" if name in OF_ADV else str(known.get(f"{name}codespace", ""))
            codes = [word_of_function(code, space) for code in text.split("; ")]
            return "; ".join(dict.fromkeys(codes))
    return ""


def _tell_year(told):
    """Year of construction in digits: the first number of four digits among years that there
    can be.
    """
    for known, _ in told:
        for name in filter(known.__contains__, YEAR):
            year = re.search(r"(?<!\d)(?:1\d|20)\d\d(?!\d)", _text(known[name]))
            if year:
                return year[0]
    return ""
