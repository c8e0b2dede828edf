"""The Transfer: relative irradiance of every surface, free of weather, and what both estimators need to make one.

In: patches and light. Out: Transfer, the plan of effects, closed forms of open patches. Read first: transfer.py.
"""
