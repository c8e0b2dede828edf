"""Blender's part of `citypv simulate`: city.blend and preview.png."""


def draw_results(folder, scene, transfer, energy, note, *, pictures):
    """Let Blender write `city.blend` and `preview.png` into a folder.

    Parameters
    ----------
    folder : pathlib.Path
    scene : Scene
    transfer : Transfer
    energy : Energy
    note : str
        Printed beside the legend.
    pictures : list of {'blend', 'preview'}
    """
    # bpy is imported here, so that the command line works without Blender if no picture is requested.
    if "blend" in pictures:
        from .write_blend import write_blend

        write_blend(folder / "city.blend", scene, transfer, energy, note)
    if "preview" in pictures:
        from .render_preview import render_preview

        render_preview(folder / "preview.png", scene, transfer, energy, note)
