"""Normalise the spelling of a coordinate reference system for pyproj."""

import re

import pyproj

# Names used by German surveys; the vertical system follows after "*".
ADV_NAMES = {
    r"ETRS89_UTM(\d\d)": lambda zone: f"EPSG:258{zone}",
    r"DE_DHDN_3GK(\d)": lambda zone: f"EPSG:3146{4 + int(zone)}",
}
# Swiss files often name the datum only; the size of coordinates tells LV03 (6 digits) from LV95 (7 digits).
SWISS_NAMES = ("CH1903", "CH1903+", "LV03", "LV95")


def name_crs(srs_name, easting=None):
    """Name of a coordinate reference system for pyproj.

    Parameters
    ----------
    srs_name : str
        As in the file: ``EPSG:25833``, ``urn:ogc:def:crs:EPSG::25833``,
        ``urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH``, ``http://www.opengis.net/def/crs/EPSG/0/6697``, ``CH1903``, …
    easting : float, optional
        First coordinate of any point [units of the system]; distinguishes the Swiss grids.

    Returns
    -------
    str or None
        None if the spelling is not known to us or to PROJ.
    """
    text = srs_name.strip()
    for name in _candidates(text, easting):
        try:
            pyproj.CRS.from_user_input(name)
        except pyproj.exceptions.CRSError:
            continue
        return name
    return None


def _candidates(text, easting):
    if text.upper() in SWISS_NAMES:
        seven_digits = easting is not None and abs(easting) > 1e6
        yield "EPSG:2056" if seven_digits or (easting is None and text != "CH1903") else "EPSG:21781"
    if text.lower().startswith("urn:adv:crs:"):
        words = text[len("urn:adv:crs:") :].split("*")
        yield from _adv_candidates(words[0])
    codes = _epsg_codes(text)
    if codes:
        yield "EPSG:" + "+".join(codes)
        yield f"EPSG:{codes[0]}"
    if text.lower().startswith(("urn:", "http")) or (not codes and re.search(r"\d", text)):
        yield text


def _adv_candidates(word):
    for pattern, write in ADV_NAMES.items():
        match = re.fullmatch(pattern, word, re.IGNORECASE)
        if match:
            yield write(match.group(1))


def _epsg_codes(text):
    # A code is the last number after each "EPSG", whatever stands between (version, colons, slashes).
    lowered = text.lower()
    if "epsg" not in lowered:
        return []
    pieces = lowered.split("epsg")[1:]
    codes = []
    for piece in pieces:
        words = re.split(r"[:/#?&,+*; ]+|crs$", piece)
        numbers = [word for word in words if re.fullmatch(r"\d{4,6}", word)]
        codes += numbers
    return codes[:2]
