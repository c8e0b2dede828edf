"""Before and after: keep a result, and show what a later one has more or less."""

import json
from dataclasses import replace
from functools import lru_cache

import bpy
import numpy as np

from ...core.settings.errors import count_of, show_end, show_number
from ..city import attributes, build_meshes
from ..city.attributes import CHANGE, CHANGE_ERROR, CODES, RESULTS, Faces
from ..city.edit_marks import check_unedited
from ..city.keys import Key
from ..city.run_step import Action, OfCity
from ..city.session import Session, list_cities
from ..show.show_result import find_before, show_result
from . import members

HOURS = "full_load_hours"


def compare_with_before(stage, city, ground):
    """Write after minus before on the faces of a city; return whether there is a result to compare
    with.

    Surfaces are matched by their shapes. Those that only one of the results has are NaN. A city
    without any common surface is another one, and not compared.

    Parameters
    ----------
    stage : bpy.types.Scene
    city, ground : bpy.types.Object or None
        With results.
    """
    # The result before, in the same scene: surfaces are matched by shape.
    before, compared = find_before(stage, city), None
    faces, changes = Faces(city, ground), [name for name in RESULTS if name.startswith(CHANGE)]
    if before is not None and Key.KWP in before and Key.KWP in city:
        from ...core.results.compare_runs import compare_states

        (olds, old_rows), (news, rows) = _read_state(before, city), _read_state(city, city)
        compared = compare_states(olds, news, _errors_of_surfaces(before, city, rows))
    # Nothing to compare: what an earlier comparison left on the faces goes.
    if compared is None or not (compared.match >= 0).any():
        for key in (Key.COMPARED, Key.MATCHED):
            city.pop(key, None)
        faces.remove(CHANGE_ERROR, *changes)
        return False
    # Changes of each surface, with their errors, on its faces.
    table, count, matched = compared.surfaces, len(city[Key.KWP]), compared.match >= 0
    for change_name in changes:
        name = change_name.removeprefix(CHANGE)
        earlier = values_of_surfaces(before, name, len(before[Key.KWP]))[
            old_rows[compared.match[matched]]
        ]
        change = np.full(count, np.nan)
        change[rows[matched]] = values_of_surfaces(city, name, count)[rows[matched]] - earlier
        faces.write_values(change_name, change)
    errors = np.full(count, np.nan)
    errors[rows] = table["full_load_hours_change_standard_error"][: len(rows)]
    faces.write_values(CHANGE_ERROR, errors)
    # Changes of buildings and of the whole, for the panel.
    tables = {
        "sums": [
            _tell_change(name, own) for name, own in compared.sums.items() if own["buildings"]
        ],
        "buildings": [
            _tell_change(row["building_id"], row) for row in compared.buildings.to_dict("records")
        ],
    }
    city[Key.COMPARED] = json.dumps(tables)
    new, gone = int((~matched).sum()), len(olds.power) - int(matched.sum())
    # A sentence tells how many surfaces were matched, are new, are gone, or would no longer pay.
    city[Key.MATCHED] = (
        f"{count_of(int(matched.sum()), 'surface')} matched by shape; grey: {new:,} new, and changes below \
two standard errors"
        + (f"; {gone:,} are gone" if gone else "")
        + (
            f"; {few:,} would no longer pay"
            if (few := int(compared.crossed["no_longer"].sum()))
            else ""
        )
    )
    return True


def _read_state(item, city):
    """Surfaces of a city, or of what was kept of it, that have faces.

    Parameters
    ----------
    item : bpy.types.Object
    city : bpy.types.Object
        Of this session, in whose reference system the shapes are.

    Returns
    -------
    CityState
        Of k surfaces: building and kind, power, why there is none, hours, their errors, and shapes.
    rows : (k,) int
        Their numbers.
    """
    from ...core.results.compare_runs import CityState

    # Surfaces by number, with the faces of each.
    mesh = item.data
    rows, first, own = np.unique(
        attributes.read_face_attribute(mesh, "surface"), return_index=True, return_inverse=True
    )
    # Middle and normal of each, by area of its faces, in the coordinates of the files: by these it
    # is found again.
    area = attributes.read_array(mesh.polygons, "area").astype(float)
    weight = np.maximum(area, 1e-12)
    total = np.bincount(own, weight)
    middle, normal = (
        np.column_stack(
            [
                np.bincount(own, weight * axis) / total
                for axis in attributes.read_array(mesh.polygons, name, 3).T
            ]
        )
        for name in ("center", "normal")
    )
    site = members.site_of(item if Key.ORIGIN in item else city)
    # By middle, root of the area, and normal.
    shapes = np.column_stack([site.to_files(middle), np.sqrt(np.bincount(own, area)), normal])
    # Hours of all surfaces with their error, each by its first face.
    hours, error = (
        attributes.read_face_attribute(mesh, name)[first]
        for name in (HOURS, HOURS + "_standard_error")
    )
    kwp, few = np.array(item[Key.KWP])[rows], np.isin(rows, item.get(Key.FEW, []))
    names, words = (
        np.array(list(item[Key.BUILDINGS]), dtype=object),
        {code: kind for kind, code in CODES["kind"].items()},
    )
    kinds = attributes.read_face_attribute(mesh, "kind")[first].tolist()
    texts = {
        "building_id": names[attributes.read_face_attribute(mesh, "building")[first]],
        "kind": [words[code] for code in kinds],
    }
    # Power [MW], NaN without modules, and why there are none: too few hours, or another reason.
    power = np.where(kwp > 0, kwp / 1000, np.nan)
    reasons = np.select([kwp > 0, few], ["", "low-hours"], "other")
    state = CityState(texts, power, reasons, hours.astype(float), error.astype(float), shapes)
    return state, rows


def _errors_of_surfaces(before, city, rows):
    """Standard errors [h] of the change of some surfaces, (k,) int, where the same rays tell it,
    else NaN; or None.
    """
    session, earlier = Session.of(city), Session.of(before)
    if (
        session is None
        or earlier is None
        or session.change is None
        or session.change[0] is not earlier.base
    ):
        return None
    names = session.transfer.surfaces.surface_id
    return np.array([session.change[1].get(names[row], np.nan) for row in rows.tolist()])


def find_variants(stage, city):
    """All variants of a city in a Blender scene, itself among them: list of bpy.types.Object."""
    family = city.get(Key.FAMILY)
    return [
        item
        for item in list_cities(stage)
        if item == city or (family and item.get(Key.FAMILY) == family)
    ]


def values_of_surfaces(item, name, count, missing=np.nan):
    """Values of an attribute by surface: (count,) float64, `missing` for surfaces without faces or
    without values.
    """
    found, faces = np.full(count, missing), attributes.read_face_attribute(item.data, "surface")
    values = attributes.read_face_attribute(item.data, name)
    if values is not None:
        found[faces] = values
    return found


def _tell_change(name, sums):
    """Row of a table: name, state, energy [MWh] before, after, its change with standard error, of
    roofs, of facades.
    """
    parts = {
        "before": "before",
        "after": "after",
        "change": "change",
        "error": "change_standard_error",
    }
    parts |= {"roofs": "change_roofs", "facades": "change_facades"}
    row = {key: round(sums[f"mwh_{word}"], 4) for key, word in parts.items()}
    return {"name": name, "state": sums.get("state", name), **row}


@lru_cache(maxsize=4)
def read_comparison(text):
    """Tables of a city's comparison: dict with "sums" and "buildings", lists of rows of
    `_tell_change`.
    """
    return json.loads(text) if text else {"sums": [], "buildings": []}


def percent_of(row):
    """Change of a row in percent of what was before, NaN where there was nothing."""
    return 100 * row["change"] / row["before"] if row["before"] > 0 else float("nan")


def write_row(row):
    """The end of a building's id, energy before and after, change with its standard error, percent:
    tuple of str.

    Changes below two errors are in brackets.
    """
    change = f"{write_energy(row['change'], plus=True)} ±{write_energy(row['error'])}"
    noise = row["change"] != 0 and abs(row["change"]) < 2 * row["error"]
    known = row["state"] != "gone" and not np.isnan(percent_of(row))
    percent = f"{show_number(percent_of(row), 1, plus=True)} %" if known else row["state"]
    name, before, after = (
        show_end(row["name"], 11),
        write_energy(row["before"]),
        write_energy(row["after"]),
    )
    return name, before, after, f"({change})" if noise else change, percent


def write_energy(value, *, plus=False):
    """Energy [MWh] with a decimal below 100."""
    return show_number(value, 0 if abs(value) >= 100 else 1, plus=plus)


class KeepBefore(OfCity, Action, bpy.types.Operator):
    """Keep the present result as "before": every later result is shown as the difference from it"""

    bl_idname, bl_label = "citypv.keep_before", "Keep as before"
    needs, lacking = Key.KWP, "Compute the energy first"

    def act(self, context, city, ground):
        """Keep a copy of the city, hidden, in place of an earlier one."""
        session, name = Session.of(city), f"{city.name} before"
        if not city.get(Key.EDITED):
            item = bpy.data.objects.new(name, city.data.copy())
        elif session is None or session.energy is None:
            return check_unedited(city)
        else:
            # Its own mesh is another one by now than when the results were computed.
            item = build_meshes.build_meshes(session.scene, name, grounded=False)[0]
            Faces(item).write_classes(session.scene.surfaces)
            Faces(item).write_results(session.transfer, session.energy)
        build_meshes.remove_objects(find_before(context.scene))
        item.data.name, item.matrix_world = item.name, city.matrix_world
        # what the panel shows of the city
        numbers = Key.TOTALS, Key.ENERGY_TOTALS, Key.WEATHER, Key.KWP
        for key in (*numbers, Key.FEW, Key.BUILDINGS, Key.ORIGIN, Key.CONVERGENCE):
            if key in city:
                item[key] = city[key]
        item[Key.PART] = "before"
        build_meshes.show_objects(context.scene, item)
        item.hide_viewport = item.hide_render = True
        if session is not None:
            replace(session).open(item)
        context.scene.citypv_seeing.side_by_side = False
        city.pop(Key.AGAINST, None)  # not a variant any more
        return "Kept as before: change what you like, then trace and compute the energy"


class ForgetBefore(Action, bpy.types.Operator):
    """Remove the result kept as before, and the differences from it"""

    bl_idname, bl_label = "citypv.forget_before", "Forget before"

    @classmethod
    def poll(cls, context):
        """There is one."""
        return find_before(context.scene) is not None

    def act(self, context, city, ground):
        """Remove it."""
        build_meshes.remove_objects(find_before(context.scene))
        shown = context.scene.citypv.attribute
        if city is not None:
            name = shown.removeprefix(CHANGE)
            if name != shown and attributes.read_face_attribute(city.data, name) is not None:
                show_result(context, city, ground, name)
            compare_with_before(context.scene, city, ground)
