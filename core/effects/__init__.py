"""Which physical effects a scene calls for, and how far each is simulated.

In: a scene, its patches and materials, the settings. Out: EffectPlan, one Effect with reason and bound per line of the
table. Read first: table.py, effect.py.
"""
