"""The button that does what Esc does."""

import bpy

from .run_step import Step


class CancelStep(bpy.types.Operator):
    """End the step that is running, and keep the suns that were traced; once more: keep nothing"""

    bl_idname = "citypv.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context):
        """A step is running."""
        return Step.current is not None

    def execute(self, context):
        """Ask it to end."""
        Step.current.cancel()
        return {"FINISHED"}
