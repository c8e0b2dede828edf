"""The report of a city, stored on its object: sentences, groups of surfaces, ids; shown as text or
copied.
"""

from pathlib import Path

import bpy
import numpy as np

from ...core.settings.errors import InputError, count_of, list_some, show_number
from ..city.attributes import CODES, read_face_attribute
from ..city.keys import Key
from ..city.run_step import Action, OfCity

NAMES_SHOWN = 3
TEXT = "CityPV report"
_FINDINGS = ("repaired", "skipped", "inside", "sheet")  # headings of what was found


def keep_report(item, scene, findings):
    """Store the report on the city's object, groups in the order of the panel; return a
    one-sentence summary.

    Parameters
    ----------
    item : bpy.types.Object
    scene : core.city.scene.Scene
    findings : list of core.list_findings.Finding
    """
    item[Key.FILES] = [str(path) for path in scene.report.files]
    item[Key.REPORT] = lines = _describe_import(scene)
    surfaces, rows = scene.surfaces, []
    pairs = np.char.add(
        np.char.add(surfaces.kind.astype(str), " "), surfaces.orientation.astype(str)
    )
    classes = np.array([name or "without class" for name in surfaces.thematic], dtype=str)
    materials = np.array(surfaces.material or [""] * len(surfaces), dtype=str)
    for heading, words, names in (
        ("kind", surfaces.kind, CODES["kind"]),
        ("orientation", surfaces.orientation, CODES["orientation"]),
        ("eligible", np.where(surfaces.eligible, "all", ""), ["all"]),
        ("eligible", np.where(surfaces.eligible, pairs, ""), None),
        ("class", classes, None),
        ("material", materials, None),
    ):
        for name in names or sorted(set(words.tolist()) - {""}):
            chosen = np.flatnonzero(words == name)
            if len(chosen) or name == "all":
                rows.append(_build_row(heading, name, chosen, float(surfaces.area[chosen].sum())))
    item[Key.REPORT_ROWS] = rows + [
        _build_row(f.heading, f.reason, f.surfaces, f.area, f.names) for f in findings
    ]
    return f"Read {lines[1]}"


def _build_row(heading, name, surfaces, area, ids=()):
    """Row of a named group of surfaces, or of elements that were left out, as it is stored: dict.

    Parameters
    ----------
    heading : str
        kind, orientation, eligible, class, material, repaired, skipped, inside or sheet.
    name : str
    surfaces : (k,) int
        Rows of the scene's surfaces; empty for what was left out.
    area : float or None [m²]
        None for elements left out that have no geometry.
    ids : list of str
        Of findings; empty if the surfaces are sufficient.
    """
    return {
        "key": f"{heading}/{name}",
        "heading": heading,
        "name": name,
        "count": f"{len(ids) or len(surfaces):,}",
        "area": "" if area is None else f"{area:,.{1 if area < 100 else 0}f} m²",
        "ids": "\n".join(ids),
        "surfaces": np.ascontiguousarray(surfaces, dtype=np.int32),
    }


def _describe_import(scene):
    """Import report in sentences: files, buildings, levels of detail, location, notes."""
    report, site = scene.report, scene.site
    names = [Path(path).name for path in report.files]
    lines = [
        ", ".join(names[:NAMES_SHOWN])
        + (f" … {len(names)} files" if len(names) > NAMES_SHOWN else "")
    ]
    counts = {
        "building": report.building_count,
        "part": report.part_count,
        "surface": len(scene.surfaces),
    }
    lines.append(", ".join(count_of(count, noun) for noun, count in counts.items()))
    for words, lods in (("Detail met", report.lods_met), ("Detail taken", report.lods_chosen)):
        told = [f"LoD {lod}: {count:,}" for lod, count in lods.items() if lod]
        lines += [f"{words}: {', '.join(told)}"] if told else []
    lines.append(f"Reference system: {site.crs or 'none named'}")
    if site.latitude is None or site.longitude is None:
        lines.append("Location unknown: give latitude and longitude")
    else:
        north, east = "N" if site.latitude >= 0 else "S", "E" if site.longitude >= 0 else "W"
        place = f"{abs(site.latitude):.5f}° {north}, {abs(site.longitude):.5f}° {east}"
        lines.append(f"{place}, altitude {site.altitude:.1f}\N{NO-BREAK SPACE}m")
    lines.append(f"Grid north: {show_number(site.convergence, 4, plus=True)}° from true north")
    return lines + list(report.notes)


def read_rows(item, heading=None):
    """Rows of an object's report, of one heading or of all: mappings with key, heading, name,
    count, area, ids.
    """
    return [row for row in item.get(Key.REPORT_ROWS, ()) if heading in (None, row["heading"])]


def find_row(item, key):
    """Row of the report called heading/name.

    Raises
    ------
    InputError
        There is none; the message names some that are there.
    """
    rows = {row["key"]: row for row in read_rows(item)}
    if key not in rows:
        known = ", ".join(list(rows)[:NAMES_SHOWN])
        raise InputError(item.name, f"its report has no group {key!r}", f"give for example {known}")
    return rows[key]


def find_faces(item, key):
    """Faces of a group: (f,) bool. The key `building/ID` means the faces of a building.

    Raises
    ------
    InputError
        There is no such group, or it has no faces.
    """
    heading, _, name = key.partition("/")
    if heading == "building":
        if name not in item.get(Key.BUILDINGS, ()):
            raise InputError(
                item.name, f"it has no building {name!r}", "see the report for building ids"
            )
        chosen, wanted = "building", [list(item[Key.BUILDINGS]).index(name)]
    else:
        chosen, wanted = "surface", np.array(find_row(item, key)["surfaces"])
    faces = read_face_attribute(item.data, chosen)
    in_group = np.isin(faces, wanted) if faces is not None else np.zeros(0, bool)
    if not in_group.any():
        raise InputError(key, "has no faces to select", "copy its ids instead")
    return in_group


def describe_row(row):
    """One line for a row: count, area, first ids."""
    return " · ".join(filter(None, (row["count"], row["area"], list_some(row["ids"].split("\n")))))


def _write_out(item):
    """Write the complete report as text: the city, weather and hours, albedos, and groups with all
    ids.
    """
    # What was read and reported, then the weather.
    lines = [*item.get(Key.FILES, ()), *item.get(Key.REPORT, ())]
    if Key.WEATHER in item or item.get(Key.ALBEDOS):
        lines.append("")
    if Key.WEATHER in item:
        lines.append(
            f"Weather: {'; '.join(item[key] for key in (Key.WEATHER, Key.WEATHER_PLACE) if item.get(key))}"
        )
    hours, albedo = (
        "Full load hours per year (group, surfaces, hours)",
        "Albedo (material, albedo, surfaces)",
    )
    # Tables of hours and albedos, columns below each other.
    for title, rows in ((hours, item.get(Key.GROUPS)), (albedo, item.get(Key.ALBEDOS))):
        if rows:
            lines += [
                title,
                *("    {:<32}{:>8}{:>10}".format(*row.split("|")).rstrip() for row in rows),
            ]
    # Materials without a known albedo, and how far an interrupted or first look came.
    lines += [item[key] for key in (Key.UNREAD, Key.INTERRUPTED) if item.get(key)]
    # Findings with all their ids.
    for row in read_rows(item):
        lines += [
            "",
            f"{row['heading']}: {row['name']}",
            f"  {row['count']}   {row['area']}".rstrip(),
        ]
        lines += [f"    {name}" for name in row["ids"].split("\n") if name]
    return "\n".join(lines) + "\n"


class ShowReport(OfCity, Action, bpy.types.Operator):
    """Write the complete report, with all ids, to the text "CityPV report", and open it"""

    bl_idname, bl_label = "citypv.show_report", "Report as text"

    def act(self, context, city, ground):
        """Write the text and show it: in the open text editors, else in one in a window of
        its own.
        """
        text = bpy.data.texts.get(TEXT) or bpy.data.texts.new(TEXT)
        text.from_string(_write_out(city))
        windows = list(context.window_manager.windows)
        areas = [
            area for window in windows for area in window.screen.areas if area.type == "TEXT_EDITOR"
        ]
        if not areas and not bpy.app.background:
            bpy.ops.wm.window_new()
            for window in set(context.window_manager.windows) - set(windows):
                areas.append(max(window.screen.areas, key=lambda area: area.width * area.height))
                areas[-1].type = "TEXT_EDITOR"
        for editor in (area.spaces.active for area in areas):
            editor.text, editor.top = text, 0
        where = "shown in the text editor" if areas else "open it in a text editor"
        return f'{len(text.lines)} lines in the text "{TEXT}": {where}'


class CopyGroup(OfCity, Action, bpy.types.Operator):
    """Copy the ids of a group of the report to the clipboard"""

    bl_idname, bl_label = "citypv.copy_group", "Copy ids"
    bl_options = set()

    group: bpy.props.StringProperty(name="Group", description="Heading/name as in the report")

    def act(self, context, city, ground):
        """Copy, one id per line."""
        row = find_row(city, self.group)
        context.window_manager.clipboard = row["ids"]
        return f"{row['count']} ids copied: {row['name']}"


def draw_rows(panel, city, headings=("class", "material", *_FINDINGS)):
    """Show the report's rows of headings, each in a subpanel: groups with what they count, findings
    with their ids. A heading without rows has no subpanel.
    """
    for heading in headings:
        rows, found = read_rows(city, heading), heading in _FINDINGS
        # Titles of the subpanels; orientations, eligible surfaces, classes and materials are closed
        # at first.
        titles = {
            "kind": "Kinds",
            "orientation": "Orientations",
            "eligible": "Eligible for photovoltaics",
            "class": "Classes of the file",
            "material": "Materials",
            "repaired": "Repaired",
            "skipped": "Left out",
            "inside": "Inside or covered",
            "sheet": "Without thickness",
        }
        body = rows and panel.open_part(
            panel.layout,
            f"citypv_{heading}",
            titles[heading],
            closed=heading in ("orientation", "eligible", "class", "material"),
        )
        for row in rows if body else ():
            column = body.column(align=True)
            # A button selects the row's faces; findings have one more that copies their ids.
            line = column.row(align=True) if found else column.split(factor=0.42)
            if found and not len(row["surfaces"]):  # what was left out has no faces to select
                line.label(text=row["name"])
            else:
                line.operator("citypv.select_group", text=row["name"]).group = row["key"]
            if found:
                line.operator("citypv.copy_group", text="", icon="COPYDOWN").group = row["key"]
                column.label(text=describe_row(row))
            else:
                panel.draw_numbers(line.split(factor=0.38), (row["count"], row["area"]))
