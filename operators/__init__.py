"""The verbs of Blender's user, and the only bridge between bpy and numpy: read settings, call core, write back."""
