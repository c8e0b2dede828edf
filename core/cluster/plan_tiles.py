"""The plan of effects for a city in tiles: of the whole while it is small, else of the tile with most surfaces.

The pilot needs a tree of all triangles that it looks at. That of a large city would take more memory on one machine
than any worker needs for its tile.
"""

from dataclasses import replace

from ..light.prepare_scene import PreparedScene
from ..materials.read_albedo import name_brdfs
from ..patches.patches import number_triangles
from ..scene.add_backs import add_backs
from ..study import prepare_study
from .take_part import take_part
from .tiles import assign_tiles, bin_pieces, box_pieces, surround

LARGEST = 1_000_000  # triangles that are planned as a whole


def plan_tiles(scene, weather, request, settings, tell):
    """What tracing a city calls for: PreparedScene; of a large one without patches, which only its tiles have.

    Parameters
    ----------
    scene : Scene
    weather : Weather
    request : Request
    settings : ClusterSettings
    tell : callable
        Takes lines for the user.
    """
    if len(scene.triangles) <= LARGEST:
        return prepare_study(scene, weather, request)
    materials, scene = name_brdfs(scene, request), add_backs(scene)
    name, part, rows = take_densest(scene, settings.tile, request.ground_albedo, materials)
    tell(f"  (decided for tile {name}, which has most surfaces)")
    of_part = [materials[row] for row in rows.tolist()] + materials[-1:]
    prepared = prepare_study(part, weather, request, materials=of_part)
    return PreparedScene(scene, materials, None, prepared.plan, prepared.suns)


def take_densest(scene, size, ground_albedo, materials):
    """Name, Scene and rows of the tile with most surfaces, and its surroundings."""
    scene = replace(scene, number=number_triangles(scene.triangle_surface))
    pieces = box_pieces(scene)
    name, rows = max(assign_tiles(scene, size), key=lambda square: len(square[1]))
    tile = surround(name, rows, pieces, bin_pieces(pieces, size), ground_albedo)
    part, rows, _, _ = take_part(scene, pieces, tile, materials)
    return name, part, rows
