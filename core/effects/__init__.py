"""Rules: which physical effects a scene calls for, and how far each is simulated. What they change
is measured later.

In: a scene, its patches and materials, the settings. Out: TracePlan, with an Effect, its reason and
bound, for each line of the table. Read first: table.py, effect.py, plan_effects.py.
"""
