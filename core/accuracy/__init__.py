"""What accuracy costs and what effects change, measured: sources of error, the pilot, rounds until
a target or a time.

In: Transfer, Energy, weather; a PreparedScene for the pilot. Out: YieldErrors, better Transfers,
error budget, prices, shares of effects. Read first: yield_errors.py, pilot.py, rounds_to_target.py.
"""

DOORS = (
    "cost_curve.WRITING",
    "cost_curve.predict_city",
    "cost_curve.predict_costs",
    "error_budget.WHAT",
    "error_budget.bound_cut_reflections",
    "error_budget.budget_groups",
    "error_budget.budget_surfaces",
    "error_budget.suggest_more",
    "measure_effects.measure_effects",
    "measure_effects.shares_of_effects",
    "measure_effects.state_effects",
    "rounds_to_target.CELLS",
    "rounds_to_target.Goal",
    "rounds_to_target.largest_round",
    "rounds_to_target.refine",
    "sun_sampling.CityYear",
    "sun_sampling.measure_ways",
    "sun_sampling.name_groups",
    "yield_errors.CERTAIN",
    "yield_errors.SOURCES",
    "yield_errors.split_errors",
)
