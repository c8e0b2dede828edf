"""Rules: which physical effects a scene calls for, and how far each is simulated. What they change
is measured later.

In: a scene, its patches and materials, the settings. Out: TracePlan, with an Effect, its reason and
bound, for each line of the table. Read first: table.py, effect.py, plan_effects.py.
"""

DOORS = (
    "beyond_scene.change_unshaded",
    "beyond_scene.sky_of_surfaces",
    "closed_form.ground_view_of_tilt",
    "closed_form.sky_view_of_tilt",
    "effect.Measured",
    "effect.TracePlan",
    "effect.describe_bound",
    "foliage.parse_months",
    "plan_effects.plan_effects",
    "rays.LIMITS",
    "rays.RECEIVERS",
    "rays.count_surely",
    "rays.fewer_rays",
    "table.PLANNING",
    "table.TABLE",
    "table.check_effects",
)
