"""The panel What if: edits of a city, its variants, and who gains and loses by them."""

from math import inf, isnan

import bpy

from ..city.build_meshes import read_told
from ..city.keys import Key
from ..city.panel import ResultPanel
from ..show.show_result import find_before
from .compare_results import find_variants, percent_of, read_comparison, write_energy, write_row


class ComparePanel(ResultPanel, bpy.types.Panel):
    """What if: edits, variants, and what they change."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_compare", "What if", 0

    def draw(self, context):
        """Show the buttons, and the totals of both results."""
        column, _, city = self.start(context)
        row = column.row(align=True)
        row.operator("citypv.update", icon="FILE_REFRESH")
        row.prop(context.scene.citypv_seeing, "live", toggle=True)
        self.draw_running("Update")
        column.operator("citypv.add_to_city", icon="ADD")
        row = column.row(align=True)
        row.operator("citypv.edit_building", icon="EDITMODE_HLT")
        row.operator("citypv.remove_building", icon="REMOVE")
        _draw_variants(column, context.scene, city)
        column.operator("citypv.keep_before", icon="COPYDOWN")
        if find_before(context.scene, city) is None:
            return
        column.operator("citypv.compare", icon="ARROW_LEFTRIGHT")
        column.prop(context.scene.citypv_seeing, "side_by_side")
        _draw_comparison(self, city, context.scene.citypv_seeing)
        self.draw_told(self.layout, city.get(Key.MATCHED))
        self.layout.operator("citypv.forget_before", icon="X")


def _draw_variants(layout, scene, shown):
    """Show the variants of the city: buttons to show, rename, compare with and delete each."""
    column = layout.column(align=True)
    for city in [city for city in find_variants(scene, shown) if Key.VARIANT in city]:
        row, against = column.row(align=True), shown.get(Key.AGAINST) == city.get(Key.IDENTITY)
        icon = "RADIOBUT_ON" if city == shown else "RADIOBUT_OFF"
        row.operator("citypv.switch_city", text="", icon=icon).name = city.name
        row.prop(city, f'["{Key.VARIANT}"]', text="")
        compare = row.row(align=True)
        compare.enabled = city != shown
        compare.operator(
            "citypv.compare", text="", icon="ARROW_LEFTRIGHT", depress=against
        ).name = city.name
        row.operator("citypv.delete_variant", text="", icon="X").name = city.name
    column.operator("citypv.new_variant", icon="DUPLICATE")


def _draw_comparison(panel, city, seeing, *, per_page=12):
    """Show who gains and who loses: sums of the buildings that are as before, changed, new or gone,
    then a page of buildings, sorted as chosen; nothing without a comparison.
    """
    tables = read_comparison(city.get(Key.COMPARED, ""))
    if not tables["sums"]:
        return
    # Sums by what happened to buildings.
    column = panel.layout.box().column(align=True)
    column.label(text="MWh per year: before → after, change")
    for row_of_table in tables["sums"]:
        _draw_change(
            panel,
            column,
            row_of_table,
            {
                "existing": "Existing",
                "changed": "Changed",
                "new": "New",
                "gone": "Gone",
                "all": "All",
            }[row_of_table["state"]],
        )
    # One page of the sorted buildings, with buttons to sort and to turn pages.
    buildings = _sort_buildings(tables["buildings"], seeing)
    pages = max(1, -(-len(buildings) // per_page))
    page = min(seeing.page, pages)
    row = panel.layout.row(align=True)
    row.use_property_split = False
    row.prop(seeing, "sort_by", text="")
    row.prop(seeing, "sort_down", text="", icon="SORT_DESC" if seeing.sort_down else "SORT_ASC")
    if pages > 1:
        row.prop(seeing, "page", text="Page")
        row.label(text=f"of {pages}")
    column, told = panel.layout.box().column(align=True), read_told(city)
    for row_of_table in buildings[(page - 1) * per_page : page * per_page]:
        _draw_change(panel, column, row_of_table, address=told.get(row_of_table["name"], ""))


def _draw_change(panel, column, row, title="", address=""):
    """Show a row of a comparison: a building with its button, by its address where files tell it,
    or a sum with its title; then what changes in it.
    """
    name, before, after, change, percent = write_row(row)
    line = column.split(factor=0.45)
    if title or row["state"] == "gone":
        line.label(text=title or name)
    else:
        line.operator("citypv.show_building", text=address or name).building = row["name"]
    panel.draw_numbers(line.row(align=True), (change,))
    line = column.split(factor=0.6)
    line.active = not change.startswith("(")
    line.label(text=f"   {before} → {after}")
    panel.draw_numbers(line.row(align=True), (percent,))
    sides = [
        f"{side} {write_energy(row[side], plus=True)}" for side in ("roofs", "facades") if row[side]
    ]
    panel.draw_numbers(column.row(align=True), (", ".join(sides),) if sides else ())


def _sort_buildings(rows, seeing):
    """Rows of buildings in the order that the panel asks for; without a value last."""
    last = -inf if seeing.sort_down else inf
    percent = [last if isnan(value) else value for value in map(percent_of, rows)]
    values = percent if seeing.sort_by == "percent" else [row[seeing.sort_by] for row in rows]
    return [
        rows[k] for k in sorted(range(len(rows)), key=values.__getitem__, reverse=seeing.sort_down)
    ]
