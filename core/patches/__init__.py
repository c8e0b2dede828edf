"""Patches: the triangles that receive and reflect light, what they reflect, and which parts of them
are covered.

In: a Scene. Out: Patches, covered cells, BRDFs, and a FacingScene for tracing rays. Read first:
patches.py.
"""

DOORS = (
    "cover_cells.enclosed_cells",
    "cover_cells.unpack_cells",
    "facing_scene.FacingScene",
    "find_covered.find_covered_cells",
    "materials.EXAMPLES",
    "materials.MaterialSpec",
    "near_faces.cells_near_faces",
    "patches.Patches",
    "patches.number_triangles",
    "read_albedo.TriangleBrdfs",
    "read_albedo.albedo_of_triangles",
    "read_albedo.brdfs_of_triangles",
    "read_albedo.check_materials",
    "read_albedo.describe_albedo",
    "read_albedo.materials_of_surfaces",
    "read_albedo.name_brdfs",
)
