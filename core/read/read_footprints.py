"""Flat maps become footprints: which features are buildings, parts or neither, their names, heights
and roofs.

Parts take the place of their outline (Simple 3D Buildings of OpenStreetMap, Overture's
`building_part`): one belongs to the building that it names, or in whose outline it lies.
"""

import math
import re
from collections import Counter, defaultdict

import numpy as np
import shapely

from ..city.extrude_footprints import Footprints
from ..city.roof_shapes import Roof
from ..settings.errors import InputError, list_some
from . import footprint_names as names
from .flat_map import OPENSTREETMAP
from .footprint_heights import DEFAULT, OUTLINE, STOREY, measure_heights
from .open_input import clean_name
from .read_attributes import list_tags

COMPASS = (
    "n",
    "nne",
    "ne",
    "ene",
    "e",
    "ese",
    "se",
    "sse",
    "s",
    "ssw",
    "sw",
    "wsw",
    "w",
    "wnw",
    "nw",
    "nnw",
)
TAGS = ("tags", "other_tags")  # columns that hold tags together


class _Features:
    """Features of one file while their meaning is found out."""

    def __init__(self, content, hints):
        self.content, self.map = content, content.flat_map
        _spread_tags(self.map)
        self.count, self.columns = len(self.map), self.map.columns
        self.names = _name_features(self.map)
        self.kept, self.part = _sort_features(self.columns, self.count, content, self.names)
        self.link = (
            [_text(value) for value in self.column("building_id")]
            if self._links()
            else [""] * self.count
        )
        self.heights = measure_heights(self.map, hints, content)
        self.building = list(self.names)

    def column(self, *texts):
        """Values of the first of some attributes that the file has; None without any."""
        known = names.find_names(self.columns, texts)
        return self.columns[known[0][0]] if known else [None] * self.count

    def _links(self):
        return bool(names.find_names(self.columns, ("building_id",)))


def read_footprints(contents, hints):
    """Give files with a flat map their footprints.

    Parameters
    ----------
    contents : list of FileContent
        Changed in place; those without a flat map are left alone.
    hints : HeightHints

    Raises
    ------
    InputError
        An attribute is not there, or more than a tenth of the outlines of a file is without a
        height.
    """
    flat = [_Features(content, hints) for content in contents if content.flat_map is not None]
    _link_parts(flat)
    for features in flat:
        _replace_outlines(features, flat)
    for features in flat:
        _fill_heights(features, hints)
        features.content.footprints = _make_footprints(features, flat)
        features.content.flat_map = None


def _text(value):
    """A value as text, "" for none."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return clean_name(str(value)).strip()


def _says_yes(value):
    # Values that deny, in lower case.
    no = ("", "no", "none", "null", "false", "0", "nan")
    return value is not None and value is not False and _text(value).lower() not in no


def _spread_tags(flat_map):
    """Make attributes of the tags that a column holds together: an object, or GDAL's text of
    `"key"=>"value"`.
    """
    for column in TAGS:
        for row, value in enumerate(flat_map.columns.get(column) or ()):
            for key, text in list_tags(value):
                if names.is_useful(key):
                    own = flat_map.columns.setdefault(key, [None] * len(flat_map))
                    own[row] = text if own[row] is None else own[row]


def _name_features(flat_map):
    """Ids of features: the file's own, else of the first attribute that tells nearly all apart."""
    # GDAL has ids of ways and of relations in two columns.
    ways, others = (flat_map.columns.get(name) for name in ("osm_way_id", "osm_id"))
    if ways and others:
        return [
            f"way/{_text(way)}"
            if _text(way)
            else f"relation/{_text(other)}"
            if _text(other)
            else ""
            for way, other in zip(ways, others, strict=True)
        ]
    if sum(map(bool, flat_map.ids)) > 0.9 * len(flat_map):
        return list(flat_map.ids)
    for name, _ in names.find_names(flat_map.columns, names.IDS):
        ids = [_text(value) for value in flat_map.columns[name]]
        known = [one for one in ids if one]
        # An id is known of nearly all, and of hardly any twice.
        if len(known) > 0.9 * len(ids) and len(set(known)) > 0.9 * len(known):
            return [own or one for own, one in zip(flat_map.ids, ids, strict=True)]
    return list(flat_map.ids)


def _sort_features(columns, count, content, ids):
    """Which features are read, buildings or parts above the ground, (f,) bool, and which are parts,
    (f,) bool.
    """

    def column(*texts):
        known = names.find_names(columns, texts)
        return columns[known[0][0]] if known else None

    kept, part = np.ones(count, bool), np.zeros(count, bool)
    # Overture names the type of a feature; OpenStreetMap has buildings, and parts of buildings.
    types = [_text(value) for value in column("type") or [None] * count]
    themes = [_text(value) for value in column("theme") or [None] * count]
    part |= np.array([word == "building_part" for word in types])
    # Where a theme "buildings" occurs, features of other themes are left out.
    if "buildings" in themes:
        kept &= np.array([word in ("", "buildings") for word in themes])
    building, parts = column("building"), column("building:part")
    if parts is not None:
        part |= np.array([_says_yes(value) for value in parts])
    if building is not None:
        tagged = np.array([_says_yes(value) for value in building])
        # In a file in which some are buildings, the others are streets, parks and water: they go,
        # with a note.
        if tagged.any():
            others = kept & ~tagged & ~part
            content.notes += (
                [f"{others.sum():,} outlines of {content.path} left out: no building."]
                if others.any()
                else []
            )
            kept &= tagged | part
    # What lies under the ground casts no shadow, and is left out and reported: a negative layer, or
    # a word that says so.
    below = np.zeros(count, bool)
    for text in ("layer", "zindex"):
        values = column(text)
        below |= np.array([_is_negative(value) for value in values or [None] * count])
    for text in ("is_underground", "underground"):
        values = column(text)
        below |= np.array([_says_yes(value) for value in values or [None] * count])
    location = column("location") or [None] * count
    below |= np.array([_text(value).lower() == "underground" for value in location])
    under = kept & below
    for row in np.flatnonzero(under):
        content.skip("underground", ids[row] or f"outline {row + 1}")
    return kept & ~below, part


def _is_negative(value):
    try:
        return float(value) < 0
    except (TypeError, ValueError):
        return False


def _link_parts(flat):
    """Give parts the name of their building: the one that they name, else the smallest outline that
    they lie in.
    """
    whole = {}  # id of a building, also without what stands before its last colon -> (file, row)
    for number, features in enumerate(flat):
        for row in np.flatnonzero(features.kept & ~features.part):
            for name in {features.names[row], features.names[row].rpartition(":")[2]} - {""}:
                whole.setdefault(name, (number, int(row)))
    uses = Counter(name for features in flat for name in features.link)
    for number, features in enumerate(flat):
        features.outline = {}  # row of a part -> (file, row) of its outline
        for row, name in enumerate(features.link):
            if name and features.kept[row] and name != features.names[row]:
                found = whole.get(name) or whole.get(name.rpartition(":")[2])
                # A building that nothing else belongs to is whole.
                features.part[row] |= uses[name] > 1 or found is not None
                features.building[row] = name
                if found is not None and found != (number, row):
                    features.outline[row] = found
                    features.building[row] = flat[found[0]].names[found[1]]
        _link_by_place(number, features)


def _link_by_place(number, features):
    """Link parts that name no building to the outline in which they lie: their file and row go to
    `features.outline`, the name of the building to `features.building`.
    """
    # Loose parts have no outline yet; whole outlines are no parts, or are tagged as buildings.
    loose = (
        features.kept
        & features.part
        & np.array([row not in features.outline for row in range(features.count)])
    )
    tagged = features.column("building")
    whole = features.kept & np.array(
        [not part or _says_yes(value) for part, value in zip(features.part, tagged, strict=True)]
    )
    # Nothing is linked where either is missing.
    if not loose.any() or not whole.any():
        return
    shapes, owner = features.map.polygons(), features.map.owner
    outlines, places = np.flatnonzero(whole[owner]), np.flatnonzero(loose[owner])
    # A point inside each loose part, and all outlines of buildings around it.
    tree = shapely.STRtree(shapes[outlines])
    place, outline = tree.query(shapely.point_on_surface(shapes[places]), "within")
    around = defaultdict(list)
    for part, around_it in zip(owner[places[place]], outlines[outline], strict=True):
        if owner[around_it] != part:
            around[int(part)].append(
                (float(shapely.area(shapes[around_it])), int(owner[around_it]))
            )
    sizes = np.bincount(owner, shapely.area(shapes), features.count)
    # Only the smallest of them may be the part's building; where that one does not count, the part
    # stays without one.
    for part, found in around.items():
        # No outline around the part counts that is clearly smaller, or lies in another itself.
        area, row = min(found)
        if area >= 0.99 * sizes[part] and row not in features.outline:
            features.outline[part] = (number, row)
            features.building[part] = features.names[row]
    # A part that is tagged as a building, too, and was linked to no other is its own outline.
    for row in np.flatnonzero(loose & whole):
        if int(row) not in features.outline:
            features.outline[int(row)] = (number, int(row))


def _replace_outlines(features, flat):
    """Leave out the outlines whose parts are drawn; parts without a height take their outline's."""
    for row, (file, outline) in features.outline.items():
        other = flat[file]
        heights, own = other.heights, features.heights
        if (file, outline) == (flat.index(features), row):
            continue
        if math.isnan(own.top[row]) and not math.isnan(heights.top[outline]):
            own.top[row], own.source[row] = heights.top[outline], OUTLINE
        if math.isnan(own.ground[row]):
            own.ground[row] = heights.ground[outline]
        if not math.isnan(own.top[row]) and not other.part[outline]:
            other.kept[outline] = False
    replaced = [
        features.names[row] or f"outline {row + 1}" for row in _outlines_with_parts(features, flat)
    ]
    if replaced:
        features.content.notes.append(
            f"{len(replaced):,} buildings are drawn by their parts: {list_some(replaced)}"
        )


def _outlines_with_parts(features, flat):
    number = flat.index(features)
    rows = {row for other in flat for file, row in other.outline.values() if file == number}
    return sorted(row for row in rows if not features.kept[row])


def _fill_heights(features, hints):
    """Give outlines without a height the user's, or leave them out if they are few, in place."""
    top, path = features.heights.top, features.content.path
    missing = np.flatnonzero(features.kept & np.isnan(top))
    if not len(missing):
        return
    # With --default-height all of them get it above their bottom, and a note tells how many.
    if hints.default:
        top[missing] = hints.default + features.heights.bottom[missing]
        # Where a height comes from is told in the results, too.
        for row in missing:
            features.heights.source[row] = DEFAULT
        features.content.notes.append(
            f"{path}: {len(missing):,} outlines without a height were given {hints.default:g} m "
            "(--default-height)."
        )
        return
    count = int(features.kept.sum())
    # More than a tenth without a height is refused; fewer are left out and reported.
    if len(missing) > 0.1 * count:
        known = ", ".join(clean_name(name) for name in list(features.columns)[:12]) or "none"
        problem = (
            f"{len(missing):,} of {count:,} outlines ({100 * len(missing) / count:.0f} %) have "
            "neither "
            f"a height nor floors (attributes: {known})"
        )
        raise InputError(
            path, problem, "give --default-height M, or name an attribute with --height NAME"
        )
    for row in missing:
        features.content.skip(
            "outline without a height or floors", features.names[row] or f"outline {row + 1}"
        )
    features.kept[missing] = False


def _make_footprints(features, flat):
    """Footprints of the features that are left in one file.

    `flat` has the features of every file: the outline of a part may stand in another. Refused
    where no feature is left.
    """
    heights, flat_map = features.heights, features.map
    # What begins above its own top is no solid: it is left out and reported. Tops above sea level
    # are not compared with bottoms.
    upside = features.kept & ~((heights.top > heights.bottom) | heights.above_sea)
    for row in np.flatnonzero(upside):
        features.content.skip(
            "begins above its own height", features.names[row] or f"outline {row + 1}"
        )
    rows = np.flatnonzero(features.kept & ~upside)
    if not len(rows):
        raise InputError(features.content.path, "no outline is left", "correct its heights")
    # Features that stay get new numbers; their polygons and rings are copied without the others'.
    number = np.full(features.count, -1)
    number[rows] = np.arange(len(rows))
    chosen = number[flat_map.owner] >= 0
    rings = np.repeat(chosen, np.diff(flat_map.polygon_start))
    sizes = np.diff(flat_map.ring_start)
    # Names of parts, shapes of roofs, and whom to name as the source.
    parts = [_name_part(features, row) for row in rows.tolist()]
    roofs = _read_roofs(features)
    _note_attribution(features)
    # Beside the polygons and rings stand each feature's building, part, heights, roof and
    # attributes. The attributes of a part's outline come last; that outline may stand in another
    # file.
    return Footprints(
        flat_map.points[np.repeat(rings, sizes)],
        np.concatenate([[0], np.cumsum(sizes[rings])]),
        np.concatenate([[0], np.cumsum(np.diff(flat_map.polygon_start)[chosen])]),
        number[flat_map.owner[chosen]],
        [features.building[row] for row in rows],
        parts,
        heights.bottom[rows],
        heights.top[rows],
        heights.ground[rows],
        [heights.source[row] for row in rows],
        heights.above_sea[rows],
        {int(number[row]): roof for row, roof in roofs.items() if number[row] >= 0},
        [_list_attributes(flat_map, row) for row in rows.tolist()],
        {
            int(number[row]): _list_attributes(flat[file].map, outline)
            for row, (file, outline) in features.outline.items()
            if number[row] >= 0
        },
    )


def _list_attributes(flat_map, row):
    """All that a file tells of a feature, as it tells it, tags one by one: dict."""
    told = flat_map.rows[row] if flat_map.rows else _take_row(flat_map.columns, row)
    for name in TAGS:
        if name in told:
            told = {key: value for key, value in told.items() if key != name}
            told |= dict(list_tags(flat_map.columns[name][row]))
    return told


def _take_row(columns, row):
    """Values of a row of a table, by column, without those that are unknown."""
    values = ((name, column[row]) for name, column in columns.items())
    return {
        name: value
        for name, value in values
        if not (value is None or isinstance(value, bytes) or _is_nan(value))
    }


def _is_nan(value):
    return isinstance(value, float) and math.isnan(value)


def _name_part(features, row):
    """Name of a part within its building, "" for a whole building."""
    if not features.part[row]:
        return ""
    return features.names[row] or f"outline {row + 1}"


def _read_roofs(features):
    """Roofs of a shape whose height and direction are given: dict of row to Roof."""
    shapes = features.column(*names.ROOF_SHAPES)
    directions, sides = (
        features.column(*names.ROOF_DIRECTIONS),
        features.column(*names.ROOF_ORIENTATIONS),
    )
    levels = features.column("roof:levels")
    roofs = {}
    for row, value in enumerate(shapes):
        shape = _text(value).lower()
        if shape not in ("gabled", "hipped", "pyramidal", "skillion") or not features.kept[row]:
            continue
        height = features.heights.roof[row]
        if math.isnan(height) and re.fullmatch(r"\d+(\.\d+)?", _text(levels[row])):
            height = STOREY * float(_text(levels[row]))
        azimuth, side = _read_direction(directions[row]), _text(sides[row]).lower()
        along = {"along": True, "across": False}.get(side)
        known = (
            shape == "pyramidal"
            or azimuth is not None
            or (shape != "skillion" and along is not None)
        )
        if height > 0 and known:
            roofs[row] = Roof(shape, float(height), azimuth, along)
    return roofs


def _read_direction(value):
    """Degrees from north of a number or a point of the compass; None for anything else."""
    text = _text(value).lower().rstrip("°").strip()
    if text in COMPASS:
        return 22.5 * COMPASS.index(text)
    try:
        degrees = float(text)
    except ValueError:
        return None
    return degrees % 360 if math.isfinite(degrees) else None


def _note_attribution(features):
    """Name those who made the data, where the attributes tell."""
    sources = features.column("sources")
    texts = " ".join(str(value) for value in sources if value)[:10_000_000]
    speaks = any(
        name.startswith(("building:", "@id", "addr:", "osm_")) for name in features.columns
    )
    ids = re.compile(r"(?:node|way|relation)/\d+")
    if (
        speaks
        or "OpenStreetMap" in texts
        or any(ids.fullmatch(name) for name in features.names[:50])
    ):
        features.content.attributions.append(OPENSTREETMAP)
    if "microsoft" in texts.lower():
        features.content.attributions.append("Microsoft building footprints, ODbL")
