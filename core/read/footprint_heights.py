"""Heights of outlines from their attributes: which attribute, in which unit, above which ground.

Of each outline the first attribute of the tables that has a value counts, else floors of 3 m, else
what the user gives for those without. A null is none, and so are `*`, −1 and 0.
"""

import math
import re
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..city.transform_crs import UNITS, plane_of
from ..settings.errors import InputError, count_of
from . import footprint_names as names
from .open_input import clean_name

STOREY = 3.0  # [m] height of a floor where only their number is known
FLOORS, DEFAULT, OUTLINE = "floors", "default", "outline"  # sources that are no measurement
LENGTH = re.compile(
    r"[~≈]?\s*([+-]?\d+(?:[.,]\d+)?|[+-]?[.,]\d+)\s*"
    r"(m|met(?:er|re)s?|ft|feet|foot|'|′|’|cm|mm|in|inch(?:es)?|\"|″|”)?\.?",
    re.IGNORECASE,
)
FEET_INCHES = re.compile(
    r"(\d+)\s*(?:'|′|’|ft)\s*(\d+(?:\.\d+)?)\s*(?:\"|″|”|''|in)?", re.IGNORECASE
)
WORDS = {
    "'": "ft",
    "′": "ft",
    "’": "ft",
    "feet": "ft",
    "foot": "ft",
    '"': "in",
    "″": "in",
    "”": "in",
}
HIGHEST = 1500.0  # [m] no building is higher


@dataclass(frozen=True)
class HeightHints:
    """What the user tells of the heights of outlines."""

    name: str | None = None  # NAME[:ft|:absolute]
    default: float = 0.0  # [m] of outlines without a height; 0: none
    unit: str = "auto"  # of `transform_crs.UNITS`, of all attributes of length; or auto
    terrain: bool = False  # whether terrain tells the height of the ground


@dataclass
class Heights:
    """Heights of the f features of a flat map."""

    top: np.ndarray  # (f,) float64 [m] above the ground, NaN where there is none
    source: list  # (f,) str, "" where there is none
    bottom: np.ndarray  # (f,) float64 [m] above the ground
    ground: np.ndarray  # (f,) float64 [m], NaN where it is not known
    roof: np.ndarray  # (f,) float64 [m] of the roof alone, NaN where it is not known
    above_sea: np.ndarray  # (f,) bool: the top is above the sea, not above the ground


def measure_heights(flat_map, hints, content):
    """Heights of the features of a flat map, before the default is given to those without.

    Parameters
    ----------
    flat_map : FlatMap
    hints : HeightHints
    content : FileContent
        Notes are added to it.

    Returns
    -------
    Heights

    Raises
    ------
    InputError
        `--height` names an attribute that the file does not have, heights above the sea have no
        height of the ground, or nine of ten buildings would be higher than 100 m.
    """
    columns = flat_map.columns
    # The attribute that the user names, floors, the ground's height, and the top: measured heights
    # first.
    given = _read_hint(hints, columns, content.path)
    floors, floors_name = _first_values(flat_map, _floor_names(columns), lambda _: 1.0)
    ground, _ = _first_values(
        flat_map, names.find_names(columns, names.GROUNDS), _chooser(hints, content), zero=True
    )
    # A ground more than 500 m below the sea counts as unknown.
    ground[ground < -500.0] = np.nan
    top, source, above_sea = _measure_tops(flat_map, (floors, ground), given, hints, content)
    # Heights that are nearly all one number times the floors count as floors, too.
    _mark_multiples(top, source, floors, content)
    # A roof's height, or its levels times 3 m, to come on top of floors.
    roof_names = names.find_names(columns, names.ROOF_HEIGHTS)
    roof, _ = _first_values(flat_map, roof_names, _chooser(hints, content))
    levels, _ = _first_values(flat_map, names.find_names(columns, names.ROOF_LEVELS), lambda _: 1.0)
    above = np.nan_to_num(np.where(np.isfinite(roof), roof, levels * STOREY))
    # Where it begins above the ground: its least height, or its lowest floor times 3 m.
    bottom, _ = _first_values(
        flat_map, names.find_names(columns, names.BOTTOMS), _chooser(hints, content)
    )
    lower, _ = _first_values(
        flat_map, names.find_names(columns, names.BOTTOM_FLOORS), lambda _: STOREY
    )
    bottom = np.nan_to_num(np.where(np.isfinite(bottom), bottom, lower))
    # Where only floors are told, the top is floors times 3 m; of OpenStreetMap, whose floors do not
    # count the roof, with the roof on top.
    estimated = np.isnan(top) & np.isfinite(floors)
    plus = above if floors_name and ":" in floors_name else 0.0  # of OpenStreetMap
    top = np.where(estimated, floors * STOREY + plus, top)
    source[estimated] = FLOORS
    # A note says which attributes told the heights of how many.
    told = ", ".join(f"{name} ({uses:,})" for name, uses in Counter(source).items() if name)
    if told:
        told = told.replace(f"{FLOORS} (", f"floors of {STOREY:g} m (") if estimated.any() else told
        content.notes.append(f"{content.path}: heights from {told}.")
    return Heights(top, source.tolist(), bottom, ground, roof, above_sea)


def _measure_tops(flat_map, known, given, hints, content):
    """Height of the top of each feature, its attribute, and whether it is above the sea: (f,)
    float64 [m], (f,) object, (f,) bool.

    Parameters
    ----------
    flat_map : FlatMap
    known : tuple
        Floors, and ground [m], (f,) float64 each.
    given : tuple or None
        As of `_read_hint`.
    hints : HeightHints
    content : FileContent
    """
    floors, ground = known
    top, source = np.full(len(flat_map), np.nan), np.full(len(flat_map), "", object)
    above_sea, grounded = np.zeros(len(flat_map), bool), np.isfinite(ground).any()
    # Attributes in order, each with its unit, and whether it is above the sea: the first value
    # counts that makes a top above 0 and at most 1500 m.
    for name, unit, high in (
        [given] if given else _list_attributes(flat_map.columns, ground, content)
    ):
        values = _column_lengths(flat_map.columns[name])
        own = _in_metres(values, unit or _unit_of(name, values[0], floors, hints, content))
        # Heights above the sea where no ground is known: these alone are returned, and without a
        # terrain they are refused.
        if high and not grounded:
            if not hints.terrain:
                raise InputError(
                    content.path,
                    f"{name} is a height above the sea, and no attribute tells that of the ground",
                    "give --terrain, or an attribute of heights above the ground",
                )
            # −1, 0 and numbers that are no height on Earth are none.
            own = np.where((own > -500) & (own < 9500) & (own != 0) & (own != -1), own, np.nan)
            return own, np.where(np.isfinite(own), name, "").astype(object), np.isfinite(own)
        # Else the ground is subtracted, from an unmarked attribute too where its numbers look like
        # heights above the sea (then a note says so).
        if high or (given is None and _is_absolute(own, ground)):
            own = own - ground
            if not high:
                content.notes.append(
                    f"{content.path}: {name} was read as a height above the sea, by the heights "
                    "of the "
                    f"ground; --height {name}:m reads it as above the ground."
                )
        own = np.where((own > 0) & (own <= HIGHEST), own, np.nan)
        new = np.isnan(top) & np.isfinite(own)
        top[new], source[new] = own[new], name
    # Without a hint of the user, ten or more tops are refused if nine of ten exceed 100 m: they are
    # above the sea, or not in metres.
    tops = top[np.isfinite(top)]
    if given is None and len(tops) >= 10 and (lowest := np.percentile(tops, 10)) > 100:
        raise InputError(
            content.path,
            f"{source[np.isfinite(top)][0]} is above {lowest:,.0f} for nine of ten outlines: "
            "heights above "
            "the sea, or not in metres",
            "give --height NAME:absolute with --terrain, --height NAME:cm, or another attribute",
        )
    return top, source, above_sea


def _list_attributes(columns, ground, content):
    """Attributes of heights that tables know, else the one whose name sounds likeliest: list of
    (name, unit, whether it is above the sea).
    """
    wanted = [(name, row.unit, False) for name, row in names.find_names(columns, names.HEIGHTS)]
    if np.isfinite(ground).any():
        wanted += [(name, row.unit, True) for name, row in names.find_names(columns, names.TOPS)]
    return wanted or [(name, "", False) for name in _guess_names(columns, content)]


def _read_hint(hints, columns, path):
    """Attribute, unit and whether it is above the sea, of `--height`; None where it is not
    given.
    """
    if not hints.name:
        return None
    name, unit, absolute = hints.name, "", False
    while name not in columns and ":" in name:
        rest, _, flag = name.rpartition(":")
        if flag == "absolute":
            absolute = True
        elif flag in UNITS:
            unit = flag
        else:
            break
        name = rest
    known = next((own for own in columns if own == name), None) or next(
        (own for own in columns if names.plain(own) == names.plain(name)), None
    )
    if known is None:
        met = ", ".join(clean_name(own) for own in list(columns)[:30]) or "none"
        raise InputError(
            "--height", f"{path} has no attribute {name!r}", f"choose one of its attributes: {met}"
        )
    return known, unit, absolute


def _floor_names(columns):
    """Attributes with the number of floors: list of (str, Name)."""
    known = names.find_names(columns, names.FLOORS)
    if known:
        return known
    guessed = names.find_by_words(columns, names.FLOOR_WORDS, names.NOT_FLOORS)
    # No building has more than 200 floors: other numbers are something else.
    likely = []
    for name in guessed:
        values = _column_lengths(columns[name])[0]
        values = values[values > 0]
        if len(values) and values.max() <= 200:
            likely.append((name, names.Name(name)))
    return likely


def _guess_names(columns, content):
    """Attributes whose name has a word for height, and whose numbers are such as buildings have:
    the likeliest alone, list of str.
    """
    best, name_of_best = 0, None
    for name in names.find_by_words(columns, names.HEIGHT_WORDS, names.NOT_HEIGHTS):
        values = _column_lengths(columns[name])[0]
        values = values[values > 0]
        if len(values) > best and 1.5 <= np.median(values) <= 1000:
            best, name_of_best = len(values), name
    if name_of_best is None:
        return []
    content.notes.append(
        f"{content.path}: {name_of_best} was taken as the height, for its name; --height NAME "
        "takes another."
    )
    return [name_of_best]


def _first_values(flat_map, found, factor_of, *, zero=False):
    """Of each feature the first value above 0 of some attributes: (f,) float64, NaN where there is
    none; and the first attribute that has any.

    Parameters
    ----------
    flat_map : FlatMap
    found : list of (str, Name)
    factor_of : callable
        Of a Name and its attribute: what its numbers are multiplied by.
    zero : bool
        Whether 0 and negative values count, too.
    """
    taken, first = np.full(len(flat_map), np.nan), ""
    for name, row in found:
        numbers, units = _column_lengths(flat_map.columns[name])
        factor = factor_of(row._replace(text=name))
        values = np.where(np.isnan(units), numbers * factor, numbers * units)
        new = np.isnan(taken) & np.isfinite(values) & (zero | (values > 0))
        taken[new] = values[new]
        first = first or (name if new.any() else "")
    return taken, first


def _chooser(hints, content):
    """Metres of one unit of an attribute of length, as `_first_values` wants it."""
    return lambda row: UNITS[row.unit or _unit_of(row.text, None, None, hints, content)]


def _column_lengths(values):
    """Numbers of an attribute, and metres per unit of those that name theirs, two (f,) float64;
    NaN where there are none.
    """
    pairs = [_parse(value) for value in values]
    return np.array(pairs, float).reshape(-1, 2).T


def _parse(value):
    if type(value) in (int, float):
        return (float(value), math.nan) if math.isfinite(value) else (math.nan, math.nan)
    if value is None or isinstance(value, bool):
        return math.nan, math.nan
    if isinstance(value, str):
        return parse_length(value)
    try:
        return float(value), math.nan
    except (TypeError, ValueError):
        return math.nan, math.nan


@lru_cache(maxsize=65536)
def parse_length(text):
    """Number and metres per unit of a text such as "12", "12,5 m", "40'" or "7'4\\"": NaN for what
    it does not tell.
    """
    text = text.strip()
    if match := FEET_INCHES.fullmatch(text):
        return float(match[1]) + float(match[2]) / 12, UNITS["ft"]
    match = LENGTH.fullmatch(text)
    if match is None:
        return math.nan, math.nan
    number, word = float(match[1].replace(",", ".")), (match[2] or "").lower()
    if not word:
        return number, math.nan
    unit = WORDS.get(word) or (
        "in" if word.startswith("inch") else "m" if word.startswith("met") else word
    )
    return number, UNITS[unit]


def _in_metres(values, unit):
    numbers, units = values
    return np.where(np.isnan(units), numbers * UNITS[unit], numbers * units)


def _unit_of(name, values, floors, hints, content):
    """Unit of an attribute of length: as the user says, as its name ends, as its floors tell, feet
    where the system of the file has them, else metres.
    """
    # The user's word first, then the ending of the name.
    if hints.unit != "auto":
        return hints.unit
    if unit := names.unit_of_name(name):
        return unit
    # Else the unit of the file's reference system, unless heights by number of floors show another.
    metres = plane_of(content.crs)[1] if content.crs else 1.0
    own = next((unit for unit in ("ft", "us-ft") if abs(metres - UNITS[unit]) < 1e-6), "m")
    if values is not None:
        # The median height of a floor tells centimetres (150 to 650), feet (7.5 to 20) or metres
        # (up to 6.5). Ten buildings at least must have both numbers; without, or with floors that
        # fit nothing, the unit of the system holds. Centimetres are noted, and feet that only the
        # floors or only the system tells.
        both = (values > 0) & (floors > 0)
        if both.sum() >= 10:
            storey = float(np.median(values[both] / floors[both]))
            if 150 <= storey <= 650:
                content.notes.append(
                    f"{content.path}: {name} was read in centimetres, since a floor would have "
                    f"{storey:.0f} m; --height {name}:m reads metres."
                )
                return "cm"
            if 7.5 <= storey <= 20:
                if own == "m":
                    content.notes.append(
                        f"{content.path}: {name} was read in feet, since a floor would have "
                        f"{storey:.1f} m; "
                        f"--height {name}:m reads metres."
                    )
                return own if own != "m" else "ft"
            if storey <= 6.5:
                return "m"
        if own != "m":
            content.notes.append(
                f"{content.path}: {name} was read in feet, the unit of its reference system; "
                f"--height {name}:m reads metres."
            )
    return own


def _is_absolute(heights, ground):
    """Whether heights are above the sea: hardly any is below its ground, which lies so high that
    heights above it would be lower.
    """
    both = (heights > 0) & np.isfinite(ground)
    if both.sum() < 3 or np.median(ground[both]) < 30:
        return False
    above = heights[both] - ground[both]
    return bool(np.mean(above > -1) >= 0.95 and 2 <= np.median(above) <= 300)


def _mark_multiples(top, source, floors, content):
    """Mark heights that are nearly all one number times the floors: estimated by the producer."""
    both = np.isfinite(top) & (floors > 0)
    if both.sum() < 10:
        return
    storey = np.round(top[both] / floors[both], 3)
    values, counts = np.unique(storey, return_counts=True)
    usual, most = float(values[counts.argmax()]), int(counts.max())
    # 95 % alike is no coincidence of measurements.
    if most < 0.95 * both.sum():
        return
    rows = np.flatnonzero(both)[storey == usual]
    source[rows] = FLOORS
    content.notes.append(
        f"{content.path}: {count_of(most, 'height')} of {both.sum():,} are {usual:g} m times the "
        "floors: "
        "estimated by the producer, not measured."
    )
