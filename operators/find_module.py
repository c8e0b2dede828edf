"""Find the module in pvlib's libraries by words of its name, as the command line does."""

import bpy

from ..core.settings.errors import InputError
from .panel_words import in_panel_words

MOST = 100  # suggestions


def suggest_modules(settings, context, text):
    """Names of modules that have all words of a text, those of the Sandia library first: list of str."""
    from ..core.energy.pick_module import CEC, SANDIA
    from ..core.energy.search_library import join_letters, read_library, split_words

    words = split_words(text)
    names = dict.fromkeys(name for library in (SANDIA, CEC) for name in read_library(library))
    found = (name for name in names if all(word in join_letters(name) for word in words))
    return [name for name, _ in zip(found, range(MOST), strict=False)]


class FindModule(bpy.types.Operator):
    """Use the module whose name has these words, in pvlib's Sandia or CEC library"""

    bl_idname = "citypv.find_module"
    bl_label = "Find module"
    bl_options = {"REGISTER", "UNDO"}

    text: bpy.props.StringProperty(
        name="Name",
        description="Name or a part of it",
        search=suggest_modules,
        search_options={"SUGGESTION"},
    )

    def invoke(self, context, event):
        """Ask for the name."""
        return context.window_manager.invoke_props_dialog(self, width=420)

    def execute(self, context):
        """Set the module."""
        from ..core.energy.pick_module import pick_module

        try:
            module = pick_module(self.text)
        except InputError as error:
            self.report({"ERROR"}, in_panel_words(error))
            return {"CANCELLED"}
        context.scene.citypv.module = module.name
        self.report({"INFO"}, f"{module.name}: {module.nominal_power:.0f} W, {module.area:.2f} m²")
        return {"FINISHED"}
