"""Store the import report on the city's object, so that it is saved with the file: sentences, groups, ids."""

from pathlib import Path

import numpy as np

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .list_groups import list_groups
from .summarise import write_results_out
from .write_attributes import read_face_attribute

REPORT, FILES, ROWS, BUILDINGS = (PREFIX + name for name in ("report", "files", "report_rows", "buildings"))
NAMES_SHOWN = 3


def keep_report(item, scene, findings):
    """Store the import report on the city's object; return a one-sentence summary.

    Parameters
    ----------
    item : bpy.types.Object
    scene : core.scene.scene.Scene
    findings : list of core.list_findings.Finding
    """
    item[FILES] = [str(path) for path in scene.report.files]
    item[REPORT] = lines = describe_import(scene)
    item[ROWS] = [
        {
            "key": f"{group.heading}/{group.name}",
            "heading": group.heading,
            "name": group.name,
            "count": write_number(group.count),
            "area": "" if group.area is None else f"{write_number(group.area)} m²",
            "ids": "\n".join(group.ids),
            "surfaces": np.ascontiguousarray(group.surfaces, dtype=np.int32),
        }
        for group in list_groups(scene, findings)
    ]
    return f"Read {lines[1]}"


def describe_import(scene):
    """Import report in sentences: files, buildings, levels of detail, location, notes."""
    report, site = scene.report, scene.site
    names = [Path(path).name for path in report.files]
    lines = [", ".join(names[:NAMES_SHOWN]) + (f" … {len(names)} files" if len(names) > NAMES_SHOWN else "")]
    counts = report.building_count, report.part_count, len(scene.surfaces)
    lines.append("{} buildings, {} parts, {} surfaces".format(*map(write_number, counts)))
    for words, lods in (("Detail met", report.lods_met), ("Detail taken", report.lods_chosen)):
        told = [f"LoD {lod}: {write_number(count)}" for lod, count in lods.items() if lod]
        lines += [f"{words}: {', '.join(told)}"] if told else []
    lines.append(f"Reference system: {site.crs or 'none named'}")
    lines.append(describe_place(site))
    lines.append(f"Grid north: {site.convergence:+.4f}° from true north")
    return lines + list(report.notes)


def describe_place(site):
    """Location on Earth as text."""
    if site.latitude is None or site.longitude is None:
        return "Location unknown: give latitude and longitude"
    north, east = "N" if site.latitude >= 0 else "S", "E" if site.longitude >= 0 else "W"
    place = f"{abs(site.latitude):.5f}° {north}, {abs(site.longitude):.5f}° {east}"
    return f"{place}, altitude {site.altitude:.1f}\N{NO-BREAK SPACE}m"


def write_number(value):
    """Format a number with thin spaces between thousands, and one decimal if it is small."""
    digits = 1 if isinstance(value, float) and value < 100 else 0
    return f"{value:,.{digits}f}".replace(",", " ")


def read_rows(item, heading=None):
    """Rows of an object's report, of one heading or of all: mappings with key, heading, name, count, area, ids."""
    rows = item.get(ROWS, ()) if item is not None else ()
    return [row for row in rows if heading in (None, row["heading"])]


def find_row(item, key):
    """Row of the report called heading/name.

    Raises
    ------
    InputError
        There is none; the message names some that are there.
    """
    rows = read_rows(item)
    for row in rows:
        if row["key"] == key:
            return row
    known = ", ".join(row["key"] for row in rows[:NAMES_SHOWN])
    raise InputError(item.name, f"its report has no group {key!r}", f"give for example {known}")


def find_faces(item, key):
    """Faces of a group: (f,) bool. The key `building/ID` means the faces of a building.

    Raises
    ------
    InputError
        There is no such group, or it has no faces.
    """
    heading, _, name = key.partition("/")
    if heading == "building":
        if name not in item.get(BUILDINGS, ()):
            raise InputError(item.name, f"it has no building {name!r}", "see the report for building ids")
        chosen, wanted = "building", [list(item[BUILDINGS]).index(name)]
    else:
        chosen, wanted = "surface", np.array(find_row(item, key)["surfaces"])
    faces = read_face_attribute(item.data, chosen)
    found = np.isin(faces, wanted) if faces is not None else np.zeros(0, bool)
    if not found.any():
        raise InputError(key, "has no faces to select", "copy its ids instead")
    return found


def describe_row(row):
    """One line for a row: count, area, first ids."""
    first = row["ids"].split("\n", NAMES_SHOWN)
    names = ", ".join(first[:NAMES_SHOWN]) + (" …" if len(first) > NAMES_SHOWN else "")
    return " · ".join(filter(None, (row["count"], row["area"], names)))


def write_out(item):
    """Write the complete report as text: the city, weather and hours, albedos, and groups with all ids."""
    lines = [*item.get(FILES, ()), *item.get(REPORT, ()), *write_results_out(item)]
    for row in read_rows(item):
        lines += ["", f"{row['heading']}: {row['name']}", f"  {row['count']}   {row['area']}".rstrip()]
        lines += [f"    {name}" for name in row["ids"].split("\n") if name]
    return "\n".join(lines) + "\n"
