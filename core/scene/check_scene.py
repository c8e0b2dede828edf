"""Check that a scene can be traced, before any ray."""

from ..settings.errors import check_array, check_triangles


def check_scene(scene):
    """Raise an error if a scene cannot be traced.

    Parameters
    ----------
    scene : Scene

    Raises
    ------
    InputError
    """
    check_triangles(scene.vertices, scene.triangles)
    count, own = len(scene.triangles), len(scene.surfaces)
    check_array("triangle_surface", scene.triangle_surface, (count,), kind="i", least=-1, most=own - 1)
    check_array("footprint", scene.footprint, (count,), kind="b")
    check_array("closure", scene.closure, (count,), kind="b")
    if scene.sheet is not None:
        check_array("sheet", scene.sheet, (count,), kind="b")
    if scene.back_of is not None:
        check_array("back_of", scene.back_of, (count,), kind="i", least=-1, most=count - 1)
    if scene.rack_of_back is not None:
        check_array("rack_of_back", scene.rack_of_back, (count,), kind="i", least=-1, most=own - 1)
