"""Patches: the triangles that receive and reflect light, what they reflect, and which parts of them
are covered.

In: a Scene. Out: Patches, covered cells, BRDFs, and a FacingScene for tracing rays. Read first:
patches.py.
"""

DOORS = (
    "brdfs.Lambertian",
    "cover_cells.enclosed_cells",
    "cover_cells.pack_cells",
    "cover_cells.unpack_cells",
    "crown_hits.stop_in_crowns",
    "facing_scene.FacingScene",
    "find_covered.UPRIGHT",
    "find_covered.cells_near_cover",
    "find_covered.find_covered_cells",
    "find_covered.lie_in_earth",
    "find_covered.starts_in_cells",
    "materials.CLEAR",
    "materials.DIFFUSE",
    "materials.MaterialSpec",
    "materials.albedo_of_colour",
    "materials.describe_brdf",
    "materials.describe_finish",
    "materials.recognise_material",
    "patches.Patches",
    "patches.keys_of_triangles",
    "patches.number_triangles",
    "patches.patches_of_scene",
    "read_albedo.TriangleBrdfs",
    "read_albedo.albedo_of_triangles",
    "read_albedo.brdfs_of_triangles",
    "read_albedo.check_materials",
    "read_albedo.describe_albedo",
    "read_albedo.materials_of_surfaces",
    "read_albedo.name_brdfs",
)
