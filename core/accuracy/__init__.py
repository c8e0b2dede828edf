"""What accuracy costs and what effects change, measured: sources of error, the pilot, rounds until
a target or a time.

In: Transfer, Energy, weather; a PreparedScene for the pilot. Out: YieldErrors, better Transfers,
error budget, prices, shares of effects. Read first: yield_errors.py, pilot.py, rounds_to_target.py.
"""

DOORS = (
    "check_goal.check_goal",
    "cost_curve.predict_costs",
    "cost_curve.seconds_of_writing",
    "error_budget.budget_errors",
    "error_budget.suggest_more",
    "measure_effects.measure_effects",
    "measure_effects.shares_of_effects",
    "measure_effects.state_effects",
    "rounds_to_target.CELLS",
    "rounds_to_target.Goal",
    "rounds_to_target.refine",
    "sun_sampling.CityYear",
    "sun_sampling.measure_ways",
    "sun_sampling.name_groups",
    "yield_errors.SOURCES",
    "yield_errors.split_errors",
)
