"""The matrix of form factors between patches, and its products with light.

In: what hemisphere rays hit. Out: the light that arrives from other patches. Read first: form_factors.py.
"""
