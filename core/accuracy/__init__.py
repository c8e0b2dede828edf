"""What accuracy costs and what effects change, measured: sources of error, the pilot, rounds until
a target or a time.

In: Transfer, Energy, weather; a PreparedScene for the pilot. Out: YieldErrors, better Transfers,
error budget, prices, shares of effects. Read first: yield_errors.py, pilot.py, refine.py.
"""
