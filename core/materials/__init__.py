"""How surfaces reflect: albedo, named materials and BRDFs.

In: the albedo file, materials of the model, settings. Out: a BRDF for each surface. Read first: materials.py.
"""
