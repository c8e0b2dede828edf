"""Cancel button, with the same effect as Esc."""

import bpy

from .run_step import Step


class CancelStep(bpy.types.Operator):
    """Cancel the running step, keeping the suns traced so far; press again to discard them"""

    bl_idname = "citypv.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context):
        """A step is running."""
        return Step.current is not None

    def execute(self, context):
        """Request cancellation."""
        Step.current.cancel()
        return {"FINISHED"}
