"""Names of coordinate reference systems, as files spell them and as pyproj knows them."""

import re
from functools import lru_cache

import pyproj

from ..settings.errors import InputError

# Names used by German surveys (GeoInfoDok); the vertical system follows after "*". The kilometres
# added to eastings by the states' variants of one system, as in DE_DHDN_3GK2_NW177, name the
# realisation and do not change the grid.
ADV_NAMES = {
    r"(?:DE_)?ETRS89_UTM(\d\d)": lambda zone: f"EPSG:258{zone}",
    r"DE_DHDN_3GK([2-5])(?:_\w+)?": lambda zone: f"EPSG:3146{4 + int(zone)}",
    r"DE_42-83_3GK([3-5])": lambda zone: f"EPSG:{2394 + int(zone)}",
    r"DE_PD-83_3GK([34])": lambda zone: f"EPSG:{3393 + int(zone)}",
    r"DE_RD-83_3GK([45])": lambda zone: f"EPSG:{3394 + int(zone)}",
    r"DE_DHDN_Soldner[-_]Berlin()": lambda _: "EPSG:3068",
    r"(?:DE_)?ETRS89_Lat-Lon()": lambda _: "EPSG:4258",
    r"(?:DE_)?ETRS89_Lat-Lon-h()": lambda _: "EPSG:4937",
    r"DE_DHDN_Lat-Lon()": lambda _: "EPSG:4314",
}


def name_crs(srs_name, easting=None):
    """Name of a coordinate reference system for pyproj.

    Parameters
    ----------
    srs_name : str
        As in the file: ``EPSG:25833``, ``urn:ogc:def:crs:EPSG::25833``,
        ``urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH``, ``http://www.opengis.net/def/crs/EPSG/0/6697``,
        ``CH1903``, …
    easting : float, optional
        Larger of the first two coordinates of any point [units of the system]; distinguishes the
        Swiss grids.

    Returns
    -------
    str or None
        None if the spelling is not known to us or to PROJ, or the system has no horizontal part.
    """
    return next(
        (name for name, system in _known_systems(srs_name, easting) if _has_plane(system)), None
    )


def choose_crs(srs_names, easting, path):
    """The one coordinate reference system that a file names.

    Parameters
    ----------
    srs_names : dict
        Spelling -> line in the file.
    easting : float or None
        As of `name_crs`.
    path : path-like

    Returns
    -------
    str or None
        None if it names none that is known. Of several names of one grid, that with heights.
    dict
        Spellings that are not known, and their lines.

    Raises
    ------
    InputError
        It names two, or only one without a horizontal part, such as a vertical or an engineering
        one.
    """
    named, unknown, flat = {}, {}, []
    # Each spelling is a system that is known, a known one without a plane (heights alone,
    # geocentric), or unknown.
    for srs_name, line in srs_names.items():
        crs = name_crs(srs_name, easting)
        kinds = [] if crs else [system for _, system in _known_systems(srs_name, easting)]
        if crs is not None:
            named.setdefault(crs, f"{srs_name!r} (line {line})")
        elif kinds:
            flat.append((kinds[0], srs_name, line))
        else:
            unknown[srs_name] = line
    # Two names of one plane are no contradiction, two planes are.
    if len({hash_plane(crs) for crs in named}) > 1:
        raise InputError(
            path,
            f"uses two coordinate reference systems: {' and '.join(list(named.values())[:2])}",
            "convert it to one of them",
        )
    # A system without a plane is refused where no other is named; of several, the one with heights
    # is taken.
    if flat and not named:
        system, srs_name, line = flat[0]
        kind = system.type_name.removesuffix(" CRS").lower()
        cure = "name a horizontal system, or none and give --latitude and --longitude"
        if system.is_geocentric:
            raise InputError(
                path, f"line {line}: geocentric coordinates are not supported", "project them first"
            )
        name = srs_name if len(srs_name) <= 60 else srs_name[:57] + "…"
        raise InputError(path, f"line {line}: {name!r} is a system without a plane ({kind})", cure)
    return pick_crs(named), unknown


def pick_crs(names):
    """Of names of one grid that with heights, None of none."""
    return max(
        names,
        key=lambda crs: (len(pyproj.CRS.from_user_input(crs).axis_info), len(crs)),
        default=None,
    )


@lru_cache(maxsize=64)
def hash_plane(crs):
    """What the horizontal part of a system, in any spelling, is told by: its EPSG code or
    definition.
    """
    system = pyproj.CRS.from_user_input(crs)
    plane = system.sub_crs_list[0] if system.is_compound else system.to_2d()
    return plane.to_epsg(100) or plane.to_wkt()


def with_zone(crs, easting, path):
    """Give a system the number of its zone before its eastings where the coordinates have it: CRS.

    Parameters
    ----------
    crs : str or None
    easting : float or None
        As of `name_crs`.
    path : path-like

    Returns
    -------
    str or None

    Raises
    ------
    InputError
        They have it, but the registry has no such system.
    """
    if crs is None or easting is None or easting < 1e6:
        return crs
    plane, *heights = pyproj.CRS.from_user_input(crs).sub_crs_list or [
        pyproj.CRS.from_user_input(crs).to_2d()
    ]
    zone = re.match(r"\d+(?=[NS]$)", plane.utm_zone or "")
    if zone is None or int(easting // 1e6) != int(zone[0]) or easting < 1e7:
        return crs
    # Grids of ETRS89 with the number of the zone before their eastings.
    with_zones = {"EPSG:25831": "EPSG:5649", "EPSG:25832": "EPSG:4647", "EPSG:25833": "EPSG:5650"}
    own = with_zones.get(f"EPSG:{plane.to_epsg(100)}")
    if own is None:
        raise InputError(
            path,
            f"eastings of {plane.name} begin with the number of the zone, {zone[0]}",
            f"subtract {zone[0]},000,000 from them",
        )
    codes = [height.to_epsg(100) for height in heights]
    return "+".join([own, *(str(code) for code in codes if code)])


def _has_plane(system):
    horizontal = system.sub_crs_list[0] if system.is_compound else system
    return horizontal.is_geographic or horizontal.is_projected


def _known_systems(srs_name, easting):
    """Names that a spelling may mean, with what PROJ knows by them: tuples of (str, pyproj.CRS)."""
    for name in _candidates(srs_name.strip(), easting):
        try:
            yield name, pyproj.CRS.from_user_input(name)
        except pyproj.exceptions.CRSError:
            continue


def _candidates(text, easting):
    """Names for PROJ that a spelling in a file may mean, the likeliest first: iterator of str."""
    lowered = text.lower()
    # Swiss files often name the datum only; the size of coordinates tells LV03 (6 digits) from LV95
    # (7). Where no coordinate is known, "CH1903" means LV03, all other names mean LV95.
    if text.upper() in ("CH1903", "CH1903+", "LV03", "LV95"):
        seven_digits = easting is not None and abs(easting) > 1e6
        yield (
            "EPSG:2056" if seven_digits or (easting is None and text != "CH1903") else "EPSG:21781"
        )
    # Names of German surveys, with or without a prefix, and without what follows a "*".
    word = text[12 * lowered.startswith("urn:adv:crs:") :].split("*")[0]
    for pattern, write in ADV_NAMES.items():
        if match := re.fullmatch(pattern, word, re.IGNORECASE):
            yield write(match[1])
    # Codes are numbers of four to six digits behind an "EPSG", whatever stands between (version,
    # colons, slashes); the first two count, as of a plane and heights.
    words = [
        word
        for piece in lowered.split("epsg")[1:]
        for word in re.split(r"[:/#?&,+*; ]+|crs$", piece)
    ]
    codes = [word for word in words if re.fullmatch(r"\d{4,6}", word)][:2]
    # Some files name the vertical system first: both orders, then each code alone.
    if codes:
        yield "EPSG:" + "+".join(codes)
        yield "EPSG:" + "+".join(codes[::-1])
        yield from (f"EPSG:{code}" for code in codes)
    # Last, PROJ may know the spelling itself: a URN, an address, or any with a digit but no code.
    if lowered.startswith(("urn:", "http")) or (not codes and re.search(r"\d", text)):
        yield text
