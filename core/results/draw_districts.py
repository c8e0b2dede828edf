"""The map of districts on the report and the solar map, in the colours of the city."""

from html import escape

import numpy as np
import shapely

from .colour_map import MAPS, linear_light, srgb_colour
from .words import say

STOPS = MAPS["viridis"].split()


def draw_map(rows, *, width=720, tallest=640, margin=6):
    """Districts coloured by their energy, with names where they fit: SVG; sizes in units of it.

    The map shows those that have buildings, and of others what lies between and beside them.

    Parameters
    ----------
    rows : list of dict
        Of `group_sums.read_districts_of`.
    """
    rows = [row for row in rows if row["shape"] is not None]
    low, high = _bounds([row["shape"] for row in rows if row["buildings"]] or [rows[0]["shape"]])
    # Degrees of longitude are shorter by the cosine of the latitude.
    narrow = np.cos(np.radians((low[1] + high[1]) / 2))
    scale = np.array([narrow, -1.0])
    spread = (high - low) * np.abs(scale)
    unit = min((width - 2 * margin) / spread[0], (tallest - 2 * margin) / spread[1])
    size = np.ceil(spread * unit + 2 * margin)
    view, start = shapely.box(0, 0, *size), np.array([low[0], high[1]])
    most = max(row["mwh_per_year"] for row in rows)
    parts = []
    for row in rows:
        drawn = shapely.transform(
            row["shape"], lambda places: (places - start) * scale * unit + margin
        )
        drawn = shapely.intersection(shapely.make_valid(shapely.simplify(drawn, 0.4)), view)
        share = row["mwh_per_year"] / most if most > 0 else 0.0
        parts.append(_draw_district(row, drawn, STOPS[round(share * (len(STOPS) - 1))]))
    title = say("Map of the districts by their energy in a year")
    scale_words = say("0 to {energy:,.0f} MWh a year", energy=most)
    return (
        f'<figure><svg class="districts" width="{size[0]:.0f}" height="{size[1]:.0f}" '
        f'viewBox="0 0 {size[0]:.0f} {size[1]:.0f}" role="img" '
        f'aria-label="{escape(title)}">{"".join(parts)}</svg>'
        f"<figcaption>{_draw_ramp()} {escape(scale_words)}</figcaption></figure>"
    )


def _bounds(shapes):
    """South-western and north-eastern corner of all shapes: two (2,) float64."""
    bounds = shapely.bounds(np.array(shapes, object))
    return bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)


def _draw_district(row, drawn, colour):
    """SVG of a district, by its row of sums, its shape in units of the drawing, and its colour: the
    shape, and name and energy where both fit; "" without an area.
    """
    polygons = [part for part in shapely.get_parts(drawn) if part.geom_type == "Polygon"]
    if not polygons:
        return ""
    rings = [ring for part in polygons for ring in (part.exterior, *part.interiors)]
    path = "".join(
        "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in ring.coords[:-1]) + "Z" for ring in rings
    )
    energy = say("{energy:,.0f} MWh", energy=row["mwh_per_year"])
    # The pointer shows name and energy, also where no letters fit in.
    hint = f"{row['name']}: {energy}"
    parts = [
        f'<path d="{path}" fill="#{colour}" fill-rule="evenodd" stroke="#fff" stroke-width="1.5">'
        f"<title>{escape(hint)}</title></path>"
    ]
    # The widest place for letters is the largest circle that fits in its largest polygon.
    circle = shapely.maximum_inscribed_circle(max(polygons, key=lambda part: part.area))
    (x, y), radius = circle.coords[0], circle.length
    if 2 * radius >= 7 * max(len(row["name"]), len(energy)):  # letters are 7 units wide
        # Black where it has more contrast than white, by the luminance of sRGB.
        luminance = linear_light(srgb_colour(colour)) @ (0.2126, 0.7152, 0.0722)
        ink = "#000" if luminance > 0.18 else "#fff"
        parts += [
            f'<text x="{x:.0f}" y="{y + line:.0f}" text-anchor="middle" font-size="13" '
            f'fill="{ink}">{escape(text)}</text>'
            for line, text in ((-3, row["name"]), (13, energy))
        ]
    return "".join(parts)


def _draw_ramp(*, step=14):
    """Colours from zero to the highest energy, as a line of words is high: SVG."""
    boxes = "".join(
        f'<rect x="{step * place}" width="{step}" height="{step}" fill="#{stop}"/>'
        for place, stop in enumerate(STOPS)
    )
    return f'<svg width="{step * len(STOPS)}" height="{step}" aria-hidden="true">{boxes}</svg>'
