"""The files of a city as properties of operators: typed, chosen in the file browser, or dropped on a view."""

import bpy


class CityFiles:
    """Mixin of operators that import a city; without a file they open the file browser."""

    filepath: bpy.props.StringProperty(
        name="File",
        description="File or folder; empty: as in the panel",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})

    whole = False  # whether the file browser goes on to all steps

    def invoke(self, context, event):
        """Start in the background; without a file, open the file browser."""
        if not (self.filepath or self.files or context.scene.citypv.city_path) and not bpy.app.background:
            bpy.ops.citypv.choose_city("INVOKE_DEFAULT", whole=self.whole)
            return {"CANCELLED"}
        return super().invoke(context, event)
