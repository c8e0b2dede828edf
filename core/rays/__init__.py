"""Rays: where they start, in which directions, and what they hit, by Embree; loops compiled ahead.

In: triangles, ray origins, directions. Out: hit triangles, barycentric weights, visibility. Read
first: ray_scene.py.
"""

DOORS = (
    "compile_ahead.compile_loops",
    "faces.Faces",
    "faces.Fate",
    "find_coincident.find_coincident",
    "hemisphere_rays.CELL_DIVISIONS",
    "hemisphere_rays.cell_at",
    "hemisphere_rays.fraction",
    "hemisphere_rays.hemisphere_rays",
    "hemisphere_rays.is_compiled",
    "hemisphere_rays.shift_replicates",
    "random_numbers.GOLDEN",
    "random_numbers.keys_of_names",
    "random_numbers.mix",
    "random_numbers.uniform",
    "random_numbers.uniform_of",
    "ray_scene.HitPlaces",
    "ray_scene.RayScene",
    "sample_points.Cells",
    "sample_points.DIGITS",
    "sample_points.HEMISPHERE_REPLICATES",
    "sample_points.additive_recurrence",
    "sample_points.barycentric_of_square",
    "sample_points.cosine_direction",
    "sample_points.sobol_digits",
    "sample_points.sobol_points",
    "surroundings.RAYS",
    "surroundings.STRAY",
    "surroundings.ask_sides",
    "surroundings.follow",
    "surroundings.lie_inside",
    "surroundings.lies_inside",
    "surroundings.number_rays",
    "surroundings.send",
)
