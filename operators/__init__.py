"""Blender operators, and the only bridge between bpy and numpy: read settings, call core, write back."""
