"""What producers call the attributes of outlines: heights, floors, ground, parts, roofs, ids.

Names are compared without regard to case and signs, and to the ten letters that a shapefile keeps.
Rows of one table are in order: the first attribute that has a value counts. What no table knows is
found by words for height and floors in a dozen languages.
"""

import re
from functools import lru_cache
from typing import NamedTuple


class Name(NamedTuple):
    """Name of an attribute, and what its numbers are."""

    text: str
    unit: str = ""  # of `transform_crs.UNITS`; "": as other evidence tells
    marks: tuple = ()  # it has that unit only beside one of these attributes, of its producer


# attributes beside which New York writes feet
NEW_YORK = ("bin", "doitt_id", "base_bbl", "mpluto_bbl", "mappluto_bbl", "groundelev", "cnstrct_yr")
HEIGHTS = (  # [m] above the ground
    *map(
        Name,
        (
            "height",  # Overture, OpenStreetMap, Global Building Atlas, EUBUCCO, Microsoft
            "building:height",  # OpenStreetMap
            "est_height",
            "building_height",
            "bldg_height",
            "measuredHeight",  # CityGML; Bavaria, Berlin, Hamburg, Sachsen-Anhalt, …
            "heightAboveGround",  # INSPIRE; Baden-Württemberg
            "HAUTEUR",  # BD TOPO
            "HN_P99",  # Flanders
            "H_Objekt",  # Sachsen
            "objekthoehe",  # ALKIS
            "gebaeudehoehe",
            "H_UVL",  # Emilia-Romagna
            "un_vol_av",  # Lombardia, Piemonte, Lazio
            "Altezza",  # Sardegna
            "altezza_vo",  # Basilicata
            "mas_alt",  # Trentino
            "CR359_UN_2",  # Abruzzo
            "GESAMTHOEHE",  # swissTLM
            "RelHMax",  # Ordnance Survey
            "RelH2",
            "hgt_median_m",  # San Francisco
            "hgt_agl",  # Vancouver
            "structure_extrusion",  # Melbourne
        ),
    ),
    Name("HEIGHTROOF", "ft", NEW_YORK),
    Name("HEIGHT_ROOF", "ft", NEW_YORK),
    *map(Name, ("HEIGHT_ROOF", "HEIGHT_WALL")),  # GeoClimate
    Name("HEIGHTROOF"),
    Name("hgt_mediancm", "cm"),
    *map(Name, ("firsthoehe", "traufhoehe", "traufenhoehe")),
)
TOPS = (  # [m] of roofs above the sea
    *map(
        Name,
        (
            "b3_h_dak_50p",  # 3DBAG
            "b3_h_dak_70p",
            "b3_h_dak_max",
            "b3_h_nok",
            "h_dak_50p",
            "h_dak_70p",
            "h_dak_max",
            "roof-0.50",  # 3D BAG 1
            "roof-0.75",
            "Z_MIN_TOIT",  # BD TOPO
            "Z_MAX_TOIT",
            "AbsH2",  # Ordnance Survey
            "AbsHMax",
            "HighestRoof",  # Helsinki
            "LowestRoof",
            "q_gronda",  # Toscana
            "TOPHEIGHT",  # Hong Kong
            "topelev_m",  # Vancouver
            "structure_max_elevation",  # Melbourne
            "roof_elevation",
        ),
    ),
)
GROUNDS = (  # [m] of the ground above the sea
    *map(
        Name,
        (
            "b3_h_maaiveld",
            "h_maaiveld",
            "ground-0.50",
            "ground-0.00",
            "Z_MIN_SOL",
            "Z_MAX_SOL",
            "AbsHMin",
            "GroundSurface",
            "q_terra",
            "BASEHEIGHT",
            "baseelev_m",
            "gnd_min_m",
            "structure_min_elevation",
            "ground_height",
            "terrain_height",
            "base_elevation",
            "h_ground",
            "z_ground",
            "ground_z",
        ),
    ),
    Name("GROUNDELEV", "ft", NEW_YORK),
    Name("GROUND_ELEVATION", "ft", NEW_YORK),
    *map(Name, ("GROUNDELEV", "GROUND_ELEVATION", "ground_elev")),
)
FLOORS = tuple(
    map(
        Name,
        (
            "building:levels",  # OpenStreetMap
            "num_floors",  # Overture
            "NumFloors",  # PLUTO
            "levels",
            "floors",
            "NB_LEV",  # GeoClimate
            "NB_ETAGES",  # BD TOPO
            "nombre_d_etages",
            "storeysAboveGround",
            "numberOfFloorsAboveGround",
            "anzahlgs",  # ALKIS
            "Stockwerke",  # Sachsen
            "ETAZA",  # Slovenia
            "GASTW",  # Switzerland
            "kerrosluku",  # Vantaa
            "storeys",
            "stories",
            "num_stories",
            "no_stories",
            "nfloors",
            "GRO_FLO_CO",  # Korea
            "byg054AntalEtager",  # Denmark
            "max_korruste_arv",  # Estonia
            "floor",
            "storey",
        ),
    )
)
BOTTOMS = tuple(map(Name, ("min_height", "building:min_height")))  # [m] above the ground
BOTTOM_FLOORS = tuple(map(Name, ("building:min_level", "min_floor", "min_level")))
ROOF_HEIGHTS = tuple(map(Name, ("roof:height", "roof_height", "building:roof:height")))
ROOF_LEVELS = (Name("roof:levels"),)
ROOF_SHAPES = ("roof:shape", "roof_shape", "building:roof:shape")
ROOF_DIRECTIONS = ("roof:direction", "roof_direction")
ROOF_ORIENTATIONS = ("roof:orientation", "roof_orientation")
IDS = (
    "@id",
    "osm_id",
    "osm_way_id",
    "full_id",
    "gml_id",
    "gml:id",
    "id",
    "building_id",
    "cleabs",
    "identificatie",
    "inspireid",
    "GRB_OIDN",
    "ID_BUD",
    "CR01_IDOBJ",
    "ClassID",
    "CLASSREF",
    "CEDIUV",
    "cr_edf_uui",
    "id_edifici",
    "bin",
    "doitt_id",
    "ID_SOURCE",
    "ID_BUILD",
    "uuid",
    "ID_E",
    "SID",
    "objectid",
    "fid",
    "ogc_fid",
)

# what else is asked of a feature
OTHERS = (
    *(
        "building",
        "building:part",
        "type",
        "theme",
        "layer",
        "zindex",
        "location",
        "is_underground",
    ),
    *("underground", "has_parts", "sources", "source"),
)

# Words in names that no table has; what is not the height of the whole building above its ground.
HEIGHT_WORDS = (
    r"height|hgt|\bht\b|h(oe|ö|o)he|hoehe|hauteur|altura|al[cç]ada|altezza|hoogte|wysok"
    r"|v[yý][sš]k|vi[sš]in"
    r"|korkeus|h(ø|oe|o|ö)jde?|h(ø|oe)yde|y[uü]kseklik|k[oõ]rgus|augst|auk[sš]t|[iî]n[aă]l[tț]im"
    r"|magass[aá]g|高さ|高度|높이"
)
FLOOR_WORDS = (
    r"floor|store?y|storie|level|etage|[eé]tage|geschoss|stockwerk|piani|planta|piso"
    r"|pavimento|kerro"
    r"|kondygn|podla[zž]|podlaz|etaj|korrus|verdiep|bouwla|v[aå]ning|st[aå]v|aukst|etaz|階数|层数|층수"
)
NOT_HEIGHTS = (
    r"min(?!e)|base|ground|gnd|terrain|sea|abs|floor|stor|level|source|src|accur|prec|error"
    r"|err\b|std|dev|date"
    r"|year|conf|under|below|cellar|basement|antenna|chimney|unit|ref|type|class|limit"
    r"|max.?allow|method|\bid\b"
    r"|entranc|door|room|tree|roof.height|quality|flag|code|count"
)
NOT_FLOORS = (
    r"under|below|basement|cellar|sub|min|area|height|hgt|h(oe|ö)he|roof|type|source"
    r"|ground.?floor|\bid\b|date|entr"
    r"|use\b|class|conf|access"
)
UNIT_ENDS = {  # how a name ends that names the unit of its numbers
    r"(?:[_ (]|\b)(?:m|met(?:er|re)s?)\)?$": "m",
    r"(?:[_ (]|\b)(?:ft|feet|foot)\)?$": "ft",
    r"(?:[_ (]|\b)cm\)?$": "cm",
    r"(?:[_ (]|\b)(?:in|inch(?:es)?)\)?$": "in",
}


@lru_cache(maxsize=4096)
def plain(name):
    """A name without case, signs and what XML puts around it."""
    name = re.sub(r"^(?:bldg|gen|fme|gml|bu-\w+):", "", name.strip())
    name = re.sub(r"[/:.]value$", "", name).rpartition("}")[2]
    return re.sub(r"[\W_]", "", name.lower())


def find_names(columns, table):
    """Attributes of a file that a table knows, in the table's order: list of (str, Name).

    Parameters
    ----------
    columns : collection of str
        Names of the attributes of the file.
    table : sequence of Name or str
    """
    known = {}
    for name in columns:
        known.setdefault(plain(name), name)
    found = []
    for row in [Name(row) if isinstance(row, str) else row for row in table]:
        name = known.get(plain(row.text)) or _find_cut(row.text, columns)
        marked = not row.marks or any(
            plain(mark) in known or _find_cut(mark, columns) for mark in row.marks
        )
        if name is not None and marked and name not in [other for other, _ in found]:
            found.append((name, row))
    return found


def _find_cut(text, columns):
    """The attribute that is a longer name cut to ten letters, None if there is none."""
    cut = re.sub(r"\W", "_", text.lower())[:10]
    if len(text) <= 10:
        return None
    return next((name for name in columns if len(name) == 10 and name.lower() == cut), None)


@lru_cache(maxsize=4096)
def is_useful(name):
    """Whether an attribute may tell something of heights, floors, parts, roofs, ids or sources."""
    tables = HEIGHTS, TOPS, GROUNDS, FLOORS, BOTTOMS, BOTTOM_FLOORS, ROOF_HEIGHTS, ROOF_LEVELS
    others = ROOF_SHAPES, ROOF_DIRECTIONS, ROOF_ORIENTATIONS, IDS, OTHERS, NEW_YORK
    return bool(
        any(find_names([name], [Name(text) for text in table]) for table in others)
        or any(find_names([name], [row._replace(marks=()) for row in table]) for table in tables)
        or find_by_words([name], f"{HEIGHT_WORDS}|{FLOOR_WORDS}", r"^$")
    )


def find_by_words(columns, words, others):
    """Attributes whose names have a word for what is sought, and none for something else: list of
    str.
    """
    spaced = {name: re.sub(r"_|(?<=[a-z])(?=[A-Z])", " ", name).lower() for name in columns}
    return [
        name
        for name, text in spaced.items()
        if re.search(words, text) and not re.search(others, text)
    ]


def unit_of_name(name):
    """Unit that the end of a name tells, "" if none: str."""
    return next((unit for end, unit in UNIT_ENDS.items() if re.search(end, name.lower())), "")
