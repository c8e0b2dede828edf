"""Labels in other languages are those of what the add-on shows."""

import re
from pathlib import Path

import bpy

from citypv import citypv_addon
from citypv.citypv_addon.translations import LABELS, OPERATORS, TABLES


def list_labels():
    """Labels of the add-on, by Blender's context of them."""
    scene = bpy.context.scene
    operators = {getattr(bpy.ops.citypv, name).get_rna_type().name for name in dir(bpy.ops.citypv)}
    labels = {item.bl_label for item in citypv_addon.CLASSES if hasattr(item, "bl_category")}
    for owner in (scene.citypv, scene.citypv_seeing):
        labels |= {item.name for item in owner.bl_rna.properties}
    root = Path(citypv_addon.__file__).parents[1]
    for path in [*root.glob("citypv_addon/*.py"), *root.glob("operators/*/*.py")]:
        labels |= set(re.findall(r'text="([^"]+)"', path.read_text("utf-8")))
    return {OPERATORS: operators, LABELS: labels}


def test_every_translated_label_is_shown_and_every_button_is_translated(addon):
    shown = list_labels()
    for language, table in TABLES.items():
        for context, label in table:
            assert label in shown[context], (language, label)
        assert {label for context, label in table if context == OPERATORS} == shown[OPERATORS]
