"""Menus: CityPV in the header of the 3D view, where F3 finds every operator, and File > Import."""

import bpy

from ..operators.run.import_city import IMPORT_LABEL
from .manual import draw_manual

GROUPS = (  # operators of the menu, between separators
    ("solar_city", "berlin_example", "choose_city", "import_city", "take_meshes", "retrace"),
    ("classify", "use_preset", "plan_effects", "predict", "trace", "find_module", "energy"),
    ("colour", "render", "probe", "show_building", "select_group", "select_buildings", "deselect"),
    ("timeline", "stop_timeline", "keep_before", "compare", "forget_before"),
    ("add_to_city", "edit_building", "remove_building", "update", "new_variant"),
    ("export", "show_report"),
)


class CityMenu(bpy.types.Menu):
    """All operators of CityPV."""

    bl_idname, bl_label = "VIEW3D_MT_citypv", "CityPV"

    def draw(self, context):
        """List them; one with a choice that the user has to make, as a submenu of it."""
        self.layout.operator_context = "INVOKE_DEFAULT"
        for number, names in enumerate(GROUPS):
            if number:
                self.layout.separator()
            for name in names:
                properties = getattr(bpy.ops.citypv, name).get_rna_type().properties
                choices = [
                    p.identifier
                    for p in properties
                    if p.type == "ENUM" and p.identifier != "rna_type"
                ]
                if choices:
                    self.layout.operator_menu_enum(f"citypv.{name}", choices[0])
                else:
                    self.layout.operator(f"citypv.{name}")
        draw_manual(self.layout)


def draw_city_menu(menu, context):
    """Add the menu to the header of the 3D view."""
    menu.layout.menu(CityMenu.bl_idname)


def draw_import_menu(menu, context):
    """Add the import to the menu File > Import."""
    menu.layout.operator_context = "INVOKE_DEFAULT"
    menu.layout.operator("citypv.choose_city", text=IMPORT_LABEL)
