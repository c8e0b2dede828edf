"""How surfaces reflect: albedo, named materials, and laws of reflection (BRDFs).

In: the albedo file, materials of the model, settings. Out: a BRDF for each surface. Read first: materials.py.
"""
